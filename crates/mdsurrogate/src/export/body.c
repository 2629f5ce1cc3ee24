static void neuron(int kind, double x, double *y, double *d, double *dd) {
    double small = exp(-fabs(x));
    double s = x < 0 ? small / (1 + small) : 1 / (1 + small), slope = s * (1 - s);
    switch (kind) {
    case 1: *y = x <= 0 ? 0 : x; *d = x <= 0 ? 0 : 1; *dd = 0; break;
    case 2: *y = (x < 0 ? 0 : x) + log1p(small); *d = s; *dd = slope; break;
    case 3: *y = tanh(x); *d = 1 - *y * *y; *dd = -2 * *y * *d; break;
    case 4: *y = s; *d = slope; *dd = slope * (1 - 2 * s); break;
    case 5: *y = x * s; *d = s + x * slope; *dd = slope * (2 + x * (1 - 2 * s)); break;
    case 6: *y = x > 0 ? x : exp(x) - 1; *d = x > 0 ? 1 : exp(x); *dd = x > 0 ? 0 : exp(x); break;
    default: *y = x; *d = 1; *dd = 0; break;
    }
}

/* first: S of a map, dN/dC of an energy; second: its derivative by C */
static double member(int m, const double *c, double first[6], double second[6][6]) {
    double x[INPUTS], d[INPUTS][6], dd[INPUTS][6][6], local[6];
    double y[LAYERS][WIDEST], dy[LAYERS][WIDEST], ddy[LAYERS][WIDEST];
    double sum[LAYERS][WIDEST][INPUTS], slope[LAYERS][WIDEST][INPUTS];
    double f[6] = {0}, h[6][6] = {{0}}, half[6][6] = {{0}}, value = 0, correction = 0;
    const double *w = weight + (size_t)m * PARAMETERS, *start[LAYERS];
    int l, k, i, j, a, b;
    for (a = 0; a < 6; a++)
        for (local[a] = 0, b = 0; b < 6; b++) local[a] += turn[6 * a + b] * c[b];
    inputs(local, x, d, dd);
    for (i = 0; i < INPUTS; i++) correction += rest[RESTS * m + 7 + i] * (x[i] - rest[RESTS * m + 7 + INPUTS + i]);
    for (i = 0; i < INPUTS; i++) x[i] = (x[i] - mean[i]) * inverse[i];
    for (l = 0; l < LAYERS; l++) {
        const double *before = l ? y[l - 1] : x, *bias = w + (size_t)width[l] * width[l + 1];
        start[l] = w;
        for (k = 0; k < width[l + 1]; k++) {
            double z = bias[k];
            for (i = 0; i < INPUTS; i++) sum[l][k][i] = 0;
            for (j = 0; j < width[l]; j++) {
                double v = w[(size_t)k * width[l] + j];
                z += v * before[j];
                if (l) for (i = 0; i < INPUTS; i++) sum[l][k][i] += v * slope[l - 1][j][i];
                else sum[l][k][j] = v;
            }
            neuron(activation[l], z, &y[l][k], &dy[l][k], &ddy[l][k]);
            for (i = 0; i < INPUTS; i++) slope[l][k][i] = dy[l][k] * sum[l][k][i];
        }
        w = bias + width[l + 1];
    }
    if (!ENERGETIC) {
        for (a = 0; a < OUTPUTS; a++) {
            first[a] = output_mean[a] + output[a] * y[LAYERS - 1][a];
            for (b = 0; b < 6; b++) second[a][b] = output[a] * slope[LAYERS - 1][a][b % INPUTS] * inverse[b % INPUTS];
        }
        return 0;
    }
    {
        double g[WIDEST] = {0}, gb[WIDEST], hessian[INPUTS][INPUTS] = {{0}};
        g[0] = 1;
        for (l = LAYERS - 1; l >= 0; l--) {
            for (j = 0; j < width[l]; j++) gb[j] = 0;
            for (k = 0; k < width[l + 1]; k++) {
                for (i = 0; i < INPUTS; i++)
                    for (j = 0; j < INPUTS; j++) hessian[i][j] += g[k] * ddy[l][k] * sum[l][k][i] * sum[l][k][j];
                for (j = 0; j < width[l]; j++) gb[j] += g[k] * dy[l][k] * start[l][(size_t)k * width[l] + j];
            }
            for (j = 0; j < width[l]; j++) g[j] = gb[j];
        }
        value = output[0] * y[LAYERS - 1][0];
        for (i = 0; i < INPUTS; i++) {
            double weight_i = output[0] * g[i] * inverse[i] + rest[RESTS * m + 7 + i];
            for (a = 0; a < 6; a++) {
                f[a] += weight_i * d[i][a];
                for (b = 0; b < 6; b++) {
                    h[a][b] += weight_i * dd[i][a][b];
                    for (j = 0; j < INPUTS; j++)
                        h[a][b] += output[0] * hessian[i][j] * inverse[i] * inverse[j] * d[i][a] * d[j][b];
                }
            }
        }
    }
    for (k = 0; k < 6; k++)
        for (a = 0; a < 6; a++)
            for (b = 0; b < 6; b++) half[k][a] += h[k][b] * turn[6 * b + a];
    for (a = 0; a < 6; a++) {
        for (first[a] = 0, k = 0; k < 6; k++) first[a] += turn[6 * k + a] * f[k];
        for (b = 0; b < 6; b++)
            for (second[a][b] = 0, k = 0; k < 6; k++) second[a][b] += turn[6 * k + a] * half[k][b];
    }
    return value + correction;
}

int NAME(const double c[6], double s[6], double tangent[36], double *energy, double *spread, unsigned *flags) {
    double all[MEMBERS][6], second[6][6], slope[36] = {0}, mean_stress[6] = {0}, w = 0, square = 0;
    double minor = c[0] * c[1] - c[3] * c[3];
    double det = c[0] * (c[1] * c[2] - c[5] * c[5]) - c[3] * (c[3] * c[2] - c[5] * c[4])
               + c[4] * (c[3] * c[5] - c[1] * c[4]);
    unsigned raised = 0;
    int a, b, m;
    for (a = 0; a < 6; a++)
        if (!isfinite(c[a])) return 1;
    if (!(c[0] > 0 && minor > 0 && det > 0)) return 1;
    for (m = 0; m < MEMBERS; m++) {
        double value = member(m, c, all[m], second), linear = 0;
        for (a = 0; a < 6; a++) {
            double two = ENERGETIC && a < 3 ? 2 : 1;
            linear += rest[RESTS * m + a] * (c[a] - (a < 3));
            all[m][a] = two * (all[m][a] - rest[RESTS * m + a]);
            mean_stress[a] += all[m][a] / MEMBERS;
            for (b = 0; b < 6; b++) slope[6 * a + b] += two * second[a][b] * (b < 3 ? 2 : 1) / MEMBERS;
        }
        if (ENERGETIC) w += (value - rest[RESTS * m + 6] - linear) / MEMBERS;
    }
    for (m = 0; m < MEMBERS; m++)
        for (a = 0; a < 6; a++) square += (all[m][a] - mean_stress[a]) * (all[m][a] - mean_stress[a]);
    square = sqrt(square / MEMBERS);
    for (a = 0; a < 6; a++) {
        double low = training_box[2 * a], high = training_box[2 * a + 1], slack = low == high ? UNSEEN : 0;
        if (!(c[a] >= low - slack && c[a] <= high + slack)) raised |= (1u << a) | (low == high ? 64u << a : 0);
        if (!isfinite(mean_stress[a])) return 2;
        for (b = 0; tangent && b < 6; b++)
            if (!isfinite(slope[6 * a + b])) return 2;
    }
    if (square > SPREAD_LIMIT) raised |= 1u << 12;
    if (REPRESENTATIVES > 0) {
        double nearest = HUGE_VAL;
        for (m = 0; m < REPRESENTATIVES; m++) {
            double distance = 0;
            for (a = 0; a < 6; a++) {
                double difference = (representative[6 * m + a] - c[a]) * representative_weight[a];
                distance += difference * difference;
            }
            if (distance < nearest) nearest = distance;
        }
        if (sqrt(nearest) > FARTHEST) raised |= 1u << 13;
    }
    for (a = 0; a < 6; a++) s[a] = mean_stress[a];
    for (a = 0; tangent && a < 36; a++) tangent[a] = slope[a];
    if (energy) *energy = w;
    if (spread) *spread = square;
    if (flags) *flags = raised;
    return 0;
}
