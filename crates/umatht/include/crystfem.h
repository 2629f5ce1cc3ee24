/* The semicrystalline material of crystfem as a pure function: link with libumatht.a or libumatht.so. */
#ifndef CRYSTFEM_H
#define CRYSTFEM_H

#include <stddef.h>

/* State variables, all 0 in fresh material. */
typedef struct {
    double z;           /* [-ln(1 - alpha)]^(1/n) */
    double degree;      /* alpha, relative crystallinity */
    double temperature; /* at the end of the increment, K */
} crystfem_state;

/* At the end of an increment. */
typedef struct {
    crystfem_state state;
    double energy;          /* change of internal energy per mass */
    double slope;           /* dU/dT, with that of crystallinity */
    double flux[3];         /* -k grad T */
    double conductivity[9]; /* d flux / d grad T, row by row, in the sign of the host */
    double step_ratio;      /* suggested next increment over this one */
} crystfem_answer;

/* Constants: conductivity, specific_heat, latent_heat (per mass, of all crystals; 0 without), kinetics (1 or 2, a column of Table 4.1, or 0),
 * absolute_zero (0 or 273.15), host (0 Abaqus, 1 CalculiX), and with kinetics 0: growth_rate, nucleation, activation_energy,
 * equilibrium_melting, frozen, avrami_exponent (1/s, K^2, J/mol, K, K, 1), melting_sharpness, melting_shape, melting_peak (1/K, 1, K; 0, 0, 0:
 * crystals never melt). With another kinetics those after the fourth may be left out from the end.
 * at: temperature at the start, its change, time in s, three components of the gradient at the end.
 * Returns 0; 1 for a number out of range, which is printed to standard error. */
int crystfem_respond(const double *constants, size_t count, const double at[6], const crystfem_state *state,
                     crystfem_answer *answer);

/* The place of a constant by its name, from 0; -1 for another name. */
int crystfem_constant(const char *name);

#endif
