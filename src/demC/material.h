/* SPDX-License-Identifier: GPL-3.0-or-later */
/**
 * material.h - coefficients of contact laws from the properties of two materials.
 */
#ifndef DEM_MATERIAL_H
#define DEM_MATERIAL_H

#include "contact_extra.h"

coefficient coefficient_of_pair(dem_law law, const dem_material *a, const dem_material *b,
                                const dem_pair *pair);
resistance resistance_of_pair(const dem_pair *pair);
/* 1/E* = (1 - nu_a^2)/E_a + (1 - nu_b^2)/E_b */
double effective_modulus(const dem_material *a, const dem_material *b);

#endif
