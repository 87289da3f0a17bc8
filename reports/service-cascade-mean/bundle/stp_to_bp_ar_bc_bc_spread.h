/* STP -> BP, AR, BC, BC_spread: 85 models with 4763 parameters
 *
 * A frozen surrogate: one call of stp_to_bp_ar_bc_bc_spread_step every 0.1 s turns the inputs of a sample into the
 * outputs of that sample. No other rate: the memory is counted in samples. It allocates nothing, keeps nothing but
 * the state it is given (so any number of them run side by side, in any thread), and needs no library but libm.
 *
 *   stp_to_bp_ar_bc_bc_spread_state state;
 *   stp_to_bp_ar_bc_bc_spread_real in[STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS], out[STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS];
 *   ... the inputs at rest into in ...
 *   stp_to_bp_ar_bc_bc_spread_init(&state, in, 0);
 *   every 0.1 s: ... the inputs into in ...;  flags = stp_to_bp_ar_bc_bc_spread_step(&state, in, out);
 *
 * Compile with -DSTP_TO_BP_AR_BC_BC_SPREAD_FLOAT for float in place of double, in every file that includes this one; how far float
 * is from the model stands in the bundle's model.json if the format c-float32 was exported, and nowhere if it was not.
 * Written by sysid-workbench 0.2.0; do not edit.
 */
#ifndef STP_TO_BP_AR_BC_BC_SPREAD_H
#define STP_TO_BP_AR_BC_BC_SPREAD_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#ifdef STP_TO_BP_AR_BC_BC_SPREAD_FLOAT
typedef float stp_to_bp_ar_bc_bc_spread_real;
#else
typedef double stp_to_bp_ar_bc_bc_spread_real;
#endif

/* Seconds between two calls of stp_to_bp_ar_bc_bc_spread_step. */
#define STP_TO_BP_AR_BC_BC_SPREAD_SAMPLE_TIME 0.1

enum { STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS = 1, STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS = 4, STP_TO_BP_AR_BC_BC_SPREAD_N_STATE = 1349, STP_TO_BP_AR_BC_BC_SPREAD_N_LOST = 85 };

/* Where each input stands, its unit, and the range that it is declared for. */
enum {
    STP_TO_BP_AR_BC_BC_SPREAD_INPUT_STP = 0 /* STP [psi], from 64.2 to 90.0 */
};

/* Where each output stands, its unit, and its level at rest. */
enum {
    STP_TO_BP_AR_BC_BC_SPREAD_OUTPUT_BP = 0, /* BP [psi], 90.0 */
    STP_TO_BP_AR_BC_BC_SPREAD_OUTPUT_AR = 1, /* AR [psi], 90.0 */
    STP_TO_BP_AR_BC_BC_SPREAD_OUTPUT_BC = 2, /* BC [psi], 0.0 */
    STP_TO_BP_AR_BC_BC_SPREAD_OUTPUT_BC_SPREAD = 3 /* BC_spread [psi], 0.0 */
};

/* Flags of a step; 0 is a step within everything that was declared. They never change the numbers. */
enum {
    STP_TO_BP_AR_BC_BC_SPREAD_OUTSIDE_RANGE = 1, /* an input is outside its declared range; the accuracy is unknown */
    STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND = 2, /* an output is held at one of its bounds; it is wrong */
    STP_TO_BP_AR_BC_BC_SPREAD_NOT_A_NUMBER = 4, /* an input is infinite or not a number, or an output is none; set the state anew */
    STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT = 8, /* an output is held at one of its limits, declared or found in the records */
    STP_TO_BP_AR_BC_BC_SPREAD_IN_DOUBT = 16 /* the models of the committee disagree; the answer may be wrong */
};

/* Past samples, newest first, channel after channel, as (value - offset) / scale; plain numbers, so that a state can
 * be copied, stored and set with an assignment. */
typedef struct {
    stp_to_bp_ar_bc_bc_spread_real past[STP_TO_BP_AR_BC_BC_SPREAD_N_STATE];
#ifdef STP_TO_BP_AR_BC_BC_SPREAD_FLOAT
    stp_to_bp_ar_bc_bc_spread_real lost[STP_TO_BP_AR_BC_BC_SPREAD_N_LOST]; /* what rounding took from the newest numbers, for the next step; 0 at the beginning */
#endif
} stp_to_bp_ar_bc_bc_spread_state;

/* Set the state to a system that has stood at these inputs and outputs for ever; outputs may be 0 (a null pointer)
 * for the declared levels at rest. Nothing of the state before is read. */
void stp_to_bp_ar_bc_bc_spread_init(stp_to_bp_ar_bc_bc_spread_state *state, const stp_to_bp_ar_bc_bc_spread_real *inputs, const stp_to_bp_ar_bc_bc_spread_real *outputs);

/* One sample: STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS inputs in, STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS outputs out, in their units. Gives back the flags. An input
 * that is not a number makes outputs not a number, and the state with them: set it anew with stp_to_bp_ar_bc_bc_spread_init. */
unsigned int stp_to_bp_ar_bc_bc_spread_step(stp_to_bp_ar_bc_bc_spread_state *state, const stp_to_bp_ar_bc_bc_spread_real *inputs, stp_to_bp_ar_bc_bc_spread_real *outputs);

/* n samples, each with its inputs side by side and its outputs side by side; flags of each, if flags is not 0. Gives
 * back all flags that were raised. Pieces equal one long run. */
unsigned int stp_to_bp_ar_bc_bc_spread_run(stp_to_bp_ar_bc_bc_spread_state *state, size_t n, const stp_to_bp_ar_bc_bc_spread_real *inputs, stp_to_bp_ar_bc_bc_spread_real *outputs, unsigned int *flags);

#ifdef __cplusplus
}
#endif

#endif
