/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * Memory that runs out on one rank, at one place after another: all ranks are told the same, none
 * is left waiting, none goes on with half of something.
 *
 * A run finds the places in the engine's code that ask for memory; then it is repeated and one of
 * them is refused it once. What the engine's libraries ask for themselves is not meant. Every call
 * has either done what it should, or says on all ranks that there was no memory.
 */
#define _GNU_SOURCE /* dl_iterate_phdr */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include "ranksFixture.h"

#include <dlfcn.h>
#include <errno.h>
#include <limits.h>
#include <link.h>

#if defined(__SANITIZE_ADDRESS__) /* which has allocators of its own */
#define HAVE_ALLOCATOR 0
#else
#define HAVE_ALLOCATOR 1
#endif

enum { SITES = 1024, GRAINS = 150, STAGES = 6 };

/* ---- the allocator --------------------------------------------------------------------------- */

static struct {
    uintptr_t base, from, to; /* where the engine is, and its code */
    int counting;
    long asked, refused; /* which one is refused, -1: none */
    int n;               /* places in the code that ask, and when each did so first and last */
    struct {
        uintptr_t caller;
        long first, last;
    } site[SITES];
} memory = {.refused = -1};

/* GNU's own, under names that are kept for this. */
void *__libc_malloc(size_t n);
void *__libc_calloc(size_t n, size_t size);
void *__libc_realloc(void *old, size_t n);
void *__libc_memalign(size_t alignment, size_t n);

#if HAVE_ALLOCATOR
static void note(uintptr_t caller)
{
    int k = 0;
    while (k < memory.n && memory.site[k].caller != caller) k++;
    if (k == SITES) return;
    if (k == memory.n) {
        memory.n++;
        memory.site[k].caller = caller;
        memory.site[k].first = memory.asked;
    }
    memory.site[k].last = memory.asked;
}

static int refuses(const void *caller)
{
    const uintptr_t at = (uintptr_t)caller;
    if (!memory.counting || at < memory.from || at >= memory.to) return 0;
    if (memory.refused < 0) note(at);
    if (memory.asked++ != memory.refused) return 0;
    memory.counting = 0; /* who prints asks for some, too */
    fprintf(stderr, "rank %d: refused at the offset %#lx of the library\n", world_rank(),
            (unsigned long)(at - memory.base));
    memory.counting = 1;
    return 1;
}

void *malloc(size_t n)
{
    return refuses(__builtin_return_address(0)) ? NULL : __libc_malloc(n);
}

void *calloc(size_t n, size_t size)
{
    return refuses(__builtin_return_address(0)) ? NULL : __libc_calloc(n, size);
}

void *realloc(void *old, size_t n)
{
    return refuses(__builtin_return_address(0)) ? NULL : __libc_realloc(old, n);
}

int posix_memalign(void **to, size_t alignment, size_t n)
{
    if (refuses(__builtin_return_address(0))) return ENOMEM;
    *to = __libc_memalign(alignment, n);
    return *to ? 0 : ENOMEM;
}
#endif

/* The library that a function of the engine is in. */
static int find_code(struct dl_phdr_info *info, size_t size, void *unused)
{
    (void)size, (void)unused;
    for (int k = 0; k < info->dlpi_phnum; k++) {
        const ElfW(Phdr) *p = &info->dlpi_phdr[k];
        const uintptr_t from = info->dlpi_addr + p->p_vaddr, to = from + p->p_memsz;
        const uintptr_t here = (uintptr_t)dlsym(RTLD_DEFAULT, "dem_advance");
        if (p->p_type != PT_LOAD || here < from || here >= to) continue;
        memory.base = info->dlpi_addr;
        memory.from = from;
        memory.to = to;
        return 1;
    }
    return 0;
}

/* ---- a run in which everything occurs -------------------------------------------------------- */

typedef struct vat {
    dem_param param;
    dem_material material;
    dem_pair pair;
    dem_wall wall;
    dem_insertion insertion;
    dem_species species;
    dem_feeder feeder;
    dem_outlet outlet;
    dem_sim *sim;
} vat;

static const double LO[3] = {0, 0, 0}, HI[3] = {.02, .016, .03};

static void prepare(vat *v)
{
    static const double low[3] = {.001, .001, .001}, high[3] = {.019, .015, .018};
    static const double above[3] = {.001, .001, .02}, top[3] = {.019, .015, .029};
    memset(v, 0, sizeof *v);
    dem_param *p = &v->param;
    *p = dem_param_default();
    memcpy(p->hi, HI, sizeof HI);
    p->gravity[2] = -9.81;
    p->rolling = DEM_ROLLING_EPSD;
    p->balance = 1;
    p->imbalance = 1.001;
    strcpy(v->material.name, "glass");
    v->material.density = 2500;
    v->pair = (dem_pair){.restitution = .8, .friction = .3, .stiffness = 200, .stiffness_ratio = 1};
    p->n_material = 1;
    p->material = &v->material;
    p->pair = &v->pair;
    strcpy(v->wall.name, "vat");
    v->wall.shape = dem_sdf_box(LO, HI, 1);
    p->n_wall = 1;
    p->wall = &v->wall;
    v->insertion.kind = DEM_INSERT_RANDOM;
    v->insertion.region = dem_sdf_box(low, high, 1);
    memcpy(v->insertion.lo, low, sizeof low);
    memcpy(v->insertion.hi, high, sizeof high);
    v->insertion.number = GRAINS;
    v->insertion.diameter = .0018;
    v->insertion.velocity[2] = -.5;
    p->n_insertion = 1;
    p->insertion = &v->insertion;
    v->species = (dem_species){.size = {.kind = DEM_SIZE_EQUAL, .mean = .0018}, .share = 1};
    v->feeder.region = dem_sdf_box(above, top, 1);
    memcpy(v->feeder.lo, above, sizeof above);
    memcpy(v->feeder.hi, top, sizeof top);
    strcpy(v->feeder.name, "spout");
    v->feeder.n_species = 1;
    v->feeder.species = &v->species;
    v->feeder.number_rate = 3000;
    v->feeder.end = 1;
    v->feeder.mass = INFINITY;
    v->feeder.number = -1;
    p->n_feeder = 1;
    p->feeder = &v->feeder;
    strcpy(v->outlet.name, "drain");
    v->outlet.region = dem_sdf_sphere((const double[3]){.02, .016, 0}, .004, 1);
    v->outlet.end = 1;
    p->n_outlet = 1;
    p->outlet = &v->outlet;
}

static void clear(vat *v, int shapes)
{
    dem_free(v->sim);
    if (!shapes) return;
    dem_sdf_free(v->wall.shape);
    dem_sdf_free(v->insertion.region);
    dem_sdf_free(v->feeder.region);
    dem_sdf_free(v->outlet.region);
}

/* All ranks have the same to say; whether it is good. */
static int well(const vat *v, dem_status status, const char *what)
{
    char here[1100], first[1100];
    memory.counting = 0;
    snprintf(here, sizeof here, "%s: %d %s", what, (int)status, status ? dem_message(v->sim) : "");
    memcpy(first, here, sizeof first);
    MPI_Bcast(first, sizeof first, MPI_CHAR, 0, MPI_COMM_WORLD);
    if (strcmp(here, first) != 0) fail_msg("'%s' here, on rank 0 '%s'", here, first);
    if (status && (status != DEM_NO_MEMORY || !strstr(here, "memory"))) fail_msg("%s", here);
    memory.counting = 1;
    return status == DEM_OK;
}

static dem_status attach(vat *v)
{
    return dem_attach(v->sim, "mine", 2) < 0 ? DEM_NO_MEMORY : DEM_OK;
}

static dem_status add(vat *v)
{
    const double x[1][3] = {{.002 + .004 * world_rank(), .008, .019}}, radius = .0008;
    const int material = 0;
    return dem_add(v->sim, 1, x, NULL, NULL, &radius, &material, NULL);
}

static dem_status blow(vat *v)
{
    static const double none[4 * GRAINS][3], k[4 * GRAINS];
    assert_true(dem_particles(v->sim).n < 4 * GRAINS);
    return dem_set_outside_force(v->sim, none, k, none, NULL);
}

/* Up to the first call that fails; how far it got. */
static int run(void)
{
    vat v;
    prepare(&v);
    memory.asked = 0;
    memory.counting = 1;
    int done = 0;
    dem_status status = dem_new(MPI_COMM_WORLD, &v.param, &v.sim);
    const int shapes = status != DEM_OK;
    done += well(&v, status, "new");
    done += done == 1 && well(&v, attach(&v), "attach");
    done += done == 2 && well(&v, dem_advance(v.sim, .01, 0), "advance");
    done += done == 3 && well(&v, add(&v), "add");
    done += done == 4 && well(&v, blow(&v), "blow");
    done += done == 5 && well(&v, dem_advance(v.sim, .01, 0), "advance");
    memory.counting = 0;
    clear(&v, shapes);
    return done;
}

static void test_memory(void **state)
{
    (void)state;
    if (!HAVE_ALLOCATOR) {
        print_message("not under AddressSanitizer\n");
        return;
    }
    memory.refused = -1;
    assert_int_equal(run(), STAGES);
    const int n = memory.n;
    int most = n, met = 0, fatal = 0;
    assert_true(n > 50 && n < SITES && memory.asked > 2 * n);
    MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    for (int k = 0; k < most; k++) {
        /* Each place on one of the ranks, every other one when it has worked many times. */
        const int mine = world_rank() == k % world_size() && k < n;
        memory.refused = !mine ? LONG_MAX : k % 2 ? memory.site[k].last : memory.site[k].first;
        const int done = run();
        int refused = mine && memory.asked > memory.refused;
        MPI_Allreduce(MPI_IN_PLACE, &refused, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
        met += refused;
        fatal += done < STAGES;
        assert_true(refused || done == STAGES);
    }
    memory.refused = LONG_MAX;
    print_message("%d places ask for memory, %d were refused it, %d runs ended by that\n", most,
                  met, fatal);
    assert_true(met > most / 2 && fatal > most / 2);
    assert_int_equal(run(), STAGES);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_memory)};
    MPI_Init(&argc, &argv);
    dl_iterate_phdr(find_code, NULL);
    const int failed = cmocka_run_group_tests(tests, NULL, NULL);
    MPI_Finalize();
    return failed;
}
