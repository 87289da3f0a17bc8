/* Run stp_to_bp_ar_bc_bc_spread.c over records. In the bundle's folder:
 *   cc -I. verify/verify.c stp_to_bp_ar_bc_bc_spread.c -lm -o verify_c && ./verify_c verify/record*.csv
 */
#include "stp_to_bp_ar_bc_bc_spread.h"

#include <math.h>
#include <stdio.h>

static int verify(const char *path)
{
    stp_to_bp_ar_bc_bc_spread_state state;
    stp_to_bp_ar_bc_bc_spread_real in[STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS], out[STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS];
    static const double allowed[] = {2e-05, 2e-05, 2e-05, 2e-05}, allowed_float32[] = {0.0009000000000000001, 0.0009000000000000001, 0.0006228401616889174, 2e-05};
    double time, value, worst = 0.0;
    unsigned int expected, faults = 0, samples = 0;
    int i, c;
    FILE *file = fopen(path, "r");

    if (!file) {
        printf("%s cannot be read\n", path);
        return 1;
    }
    do { /* names and units */
        c = getc(file);
    } while (c != '\n' && c != EOF);
    while (fscanf(file, "%lf", &time) == 1) {
        for (i = 0; i < STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS; i++) {
            faults += fscanf(file, ",%lf", &value) != 1;
            in[i] = (stp_to_bp_ar_bc_bc_spread_real)value;
        }
        if (samples++ == 0) {
            stp_to_bp_ar_bc_bc_spread_init(&state, in, 0);
        }
        expected = stp_to_bp_ar_bc_bc_spread_step(&state, in, out);
        for (i = 0; i < STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS; i++) {
            faults += fscanf(file, ",%lf", &value) != 1;
            if (value != value && out[i] != out[i]) {
                continue;
            }
            if (!(fabs((double)out[i] - value) <= worst)) {
                worst = fabs((double)out[i] - value);
            }
            faults += !(fabs((double)out[i] - value) <= (sizeof *in == sizeof(float) ? allowed_float32 : allowed)[i]);
        }
        faults += fscanf(file, ",%lf", &value) != 1 || (unsigned int)value != expected;
    }
    fclose(file);
    faults += samples == 0;
    printf("%s: %s, largest difference %.1e\n", path, faults ? "NOT as recorded" : "as recorded", worst);
    return faults != 0;
}

int main(int argc, char **argv)
{
    int i, faults = 0;

    for (i = 1; i < argc; i++) {
        faults += verify(argv[i]);
    }
    if (argc < 2) {
        fprintf(stderr, "name the records: %s verify/record*.csv\n", argv[0]);
    }
    return argc < 2 || faults;
}
