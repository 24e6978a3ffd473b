/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * fields.h - time directories in OpenFOAM's own format.
 */
#ifndef FIELDS_H
#define FIELDS_H

#include "coupling.h"
#include "settings.h"

/**
 * Write U and p (as p/rho), and with particles voidfraction and Us, into <case>/<time>/. On the
 * mesh that blockMesh makes of the case, ParaView and OpenFOAM's tools read them. Each file is
 * written whole and then renamed. 0, or -1 with the text in message.
 */
int mac_write_fields(const mac_case *c, const mac_coupled *coupled, double time, char *message,
                     size_t size);

#endif
