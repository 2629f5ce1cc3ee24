//! Scalars in the reports of `mdsurrogate`.

harness::quantities! {
    /// Scalars of data; those of held-out runs have the prefix `heldout.`.
    pub DATA_QUANTITIES:
    ROWS = "rows", "", "number of rows in the data";
    PATHS = "paths", "", "number of runs in the data";
    SKIPPED_ROWS = "skipped_rows", "", "number of rows left out as the scene requests";
    DUPLICATE_ROWS = "duplicate_rows", "", "number of rows that repeat an earlier one";
    CONSTANT_COMPONENTS = "constant_components", "", "number of constant components of C and S";
    PATHS_OF_KIND = "paths_of_kind_{kind}", "", "number of runs of a kind of loading";
    LEAST_C = "least_c{component}", "", "smallest value of a component of C";
    GREATEST_C = "greatest_c{component}", "", "largest value of a component of C";
    LEAST_PRINCIPAL_STRETCH = "least_principal_stretch", "", "smallest principal stretch";
    GREATEST_PRINCIPAL_STRETCH = "greatest_principal_stretch", "", "largest principal stretch";
    NOISE = "noise_{stress}{component}", "MPa",
        "standard deviation of the noise of a component, from neighbouring rows";
    NOISE_FLOOR = "noise_floor_{stress}", "MPa²", "error (3.12) of a perfect model, due to the noise";
    LAG_1 = "lag_1_correlation_{stress}", "", "correlation of the noise of neighbouring rows";
    LAG_1_IF_WHITE = "lag_1_correlation_{stress}_if_white", "", "the same correlation for white noise";
    SET_ROWS = "{set}.rows", "", "number of rows in the training, validation or test set";
    TRAINING_MEAN = "training.mean_c{component}", "", "mean of a component of C in the training rows";
    TRAINING_DEVIATION = "training.deviation_c{component}", "",
        "standard deviation of a component of C in the training rows";
    NEAREST_TRAINING_ROW = "test.nearest_training_row", "",
        "median distance from a test row to the nearest training row, in standard deviations";
    NEAREST_OTHER_ROW = "training.nearest_other_row", "",
        "median distance from a training row to the nearest other training row, in standard deviations";
    NEIGHBOURS_OF_RUN = "test.neighbours_of_their_run", "",
        "fraction of test rows whose nearest training row belongs to the same run";
    LEAK_RATIO = "leak_ratio", "",
        "ratio of these distances, test over training: about 1 for a random split of rows, larger for whole \
         runs";
    MODULUS = "modulus_{axis}", "GPa",
        "slope of σ between strains of 0.02 and 0.08 in the uniaxial runs (kinds `ux`, `uy`, `uz`)";
    PEAK_STRESS = "peak_stress_{axis}", "GPa", "largest mean of σ over five samples in a direction";
    PEAK_STRAIN = "peak_strain_{axis}", "", "engineering strain at this peak";
    STIFFENING = "stiffening_{axis}", "",
        "slope between strains of 0.12 and 0.20 over that between 0.04 and 0.12";
    MODULUS_RATIO = "modulus_z_over_{axis}", "", "modulus in z over that in another direction";
    PEAK_STRAIN_RATIO = "peak_strain_{axis}_over_z", "", "strain at the peak in a direction over that in z";
}

harness::quantities! {
    /// Scalars of models; `{set}` is `training`, `validation`, `test`, `heldout.RUN`, `run.RUN` or
    /// `all_runs`.
    pub MODEL_QUANTITIES:
    PARAMETERS = "{model}.parameters", "", "number of parameters of a network, for one member";
    SPREAD_LIMIT = "{model}.spread_limit", "MPa",
        "largest spread of an ensemble on its training rows; predictions with a larger spread are flagged";
    BEST_EPOCH = "{model}.best_epoch", "", "epoch with the lowest validation loss";
    MEMBER_BEST_EPOCH = "{model}.member_{number}.best_epoch", "",
        "epoch with the lowest validation loss of a member of an ensemble";
    MEAN_SQUARE_ERROR = "{model}.{set}.mean_square_error", "MPa²",
        "squared error, summed over the six components, mean over the rows, Eq. (3.12)";
    COMPONENT_ERROR = "{model}.{set}.error_per_component", "MPa²",
        "a sixth of the mean square error, as in Keras";
    PERCENTAGE_ERROR = "{model}.{set}.percentage_error", "%",
        "mean of |S − Ŝ|/|S|, Eq. (3.13), the error measure of the thesis; the model `zero_stress` predicts \
         S = 0 (100 %), `noise` is the lower bound due to the noise";
    SHARE_OUTSIDE = "{model}.{set}.share_outside_training", "",
        "fraction of rows outside the box of the training data";
    ERROR_OVER_NOISE = "{model}.{set}.error_over_noise", "",
        "mean square error over the variance of the noise of single rows; at least 1 for any model";
    ERROR_WITHOUT_SOFTENING = "{model}.{set}.error_without_softening", "",
        "mean square error of the energy without its damage variable over that with it, on held-out runs";
    SHARE_BADLY_WRONG = "{model}.{set}.share_badly_wrong", "",
        "fraction of rows with an error above a tenth of the stress and three times the noise";
    CAUGHT_BY = "{model}.{set}.caught_by_{flag}", "",
        "fraction of these rows with a flag: `any_flag`, `box`, `distance` or `spread`";
    FALSE_ALARMS = "{model}.{set}.false_alarms_of_{flag}", "", "fraction of the other rows with this flag";
    RANK_CORRELATION = "{model}.{set}.rank_correlation", "",
        "Spearman's rank correlation of spread and error, for an ensemble";
    WITHIN = "{model}.{set}.share_within_{count}_std_of_s{component}", "",
        "for an ensemble: fraction of rows whose measured component lies within `1` or `2` standard \
         deviations of the prediction; 0.683 and 0.954 for normal errors";
    SHARE_FLAGGED = "{model}.{set}.share_flagged", "", "for nominal stresses: fraction of rows with any flag";
    MEAN_ABSOLUTE_ERROR = "{model}.{set}.mean_absolute_error", "MPa",
        "mean of |P − P̂| over the measured stresses";
    RMS = "{model}.{set}.rms", "MPa", "root mean square of P − P̂ over the measured stresses";
    R2 = "{model}.{set}.r2", "", "1 − Σ(P − P̂)²/Σ(P − P̄)² over the measured stresses";
    UNSEEN_ERROR_RATIO = "{model}.unseen_error_over_{other}", "",
        "error on validation and test rows over that of the same network with the scene's split";
    STRESS_AT_REST = "{model}.stress_at_rest", "MPa", "‖S(I)‖";
    ASYMMETRY = "{model}.tangent_asymmetry", "", "mean of ‖ℂ − ℂᵀ‖/‖ℂ‖ over the test rows";
    LARGEST_ASYMMETRY = "{model}.largest_tangent_asymmetry", "", "largest ‖ℂ − ℂᵀ‖/‖ℂ‖ of the test rows";
    CYCLE = "{model}.work_of_a_closed_cycle", "",
        "|∮ S:dC/2| over ∮ |S:dC/2| around a rectangle in C₁₁ and C₃₃, from I to half of the training box";
    OBJECTIVITY = "{model}.lack_of_objectivity", "", "largest ‖σ(RF) − R σ(F) Rᵀ‖/‖σ(F)‖";
    LEAST_WAVE = "{model}.least_acoustic_eigenvalue", "MPa",
        "smallest eigenvalue of the acoustic tensor over all directions and up to 500 training strains; \
         negative if the law loses ellipticity";
    LEAST_WAVE_AT = "{model}.least_acoustic_eigenvalue_at_c{component}", "",
        "component of C at this eigenvalue";
    NOT_ELLIPTIC = "{model}.share_not_elliptic", "",
        "fraction of these strains at which the law loses ellipticity";
    UNSEEN_SHEAR = "{model}.unseen_shear_stress", "MPa",
        "shear stress in simple shears of 0.05, if the data contain no shear";
    SHEAR_FLAGGED = "{model}.share_of_shear_flagged", "", "fraction of these shears that are flagged";
    BINNED = "{model}.heldout.percentage_error_c{component}_{from}_to_{to}", "%",
        "mean of (3.13) over the held-out runs pulled along an axis, between two values of C";
    AS_EXPECTED = "{trial}.as_expected", "", "1 if a trial ended as its scene expects, otherwise 0";
}

harness::quantities! {
    /// Scalars of searches; `{method}` is `random`, `hyperband` or `bayesian`.
    pub SEARCH_QUANTITIES:
    CANDIDATES = "candidates", "", "number of trained candidates";
    DIVERGED = "diverged_candidates", "", "number of candidates with a non-finite loss";
    BEST_LOSS = "{method}.best_validation_loss", "MPa²", "lowest validation loss of a method";
    MEDIAN_LOSS = "{method}.median_validation_loss", "MPa²",
        "median over the seeds of the lowest validation loss";
    WORST_LOSS = "{method}.worst_validation_loss", "MPa²",
        "largest over the seeds of the lowest validation loss";
    MEDIAN_EPOCHS = "{method}.median_epochs", "", "median over the seeds of the epochs of a search";
    LOSS_OVER_RANDOM = "{method}.loss_over_random", "", "median loss of a method over that of random search";
    CHOSEN_PARAMETERS = "chosen.parameters", "", "number of parameters of the chosen candidate";
    CHOSEN_LOSS = "chosen.validation_loss", "MPa²", "validation loss of the chosen candidate";
}

harness::quantities! {
    /// Scalars of the crystal and the grid of runs; `{cell}` is `cell` or `supercell`.
    pub CRYSTAL_QUANTITIES:
    DENSITY = "density", "g/cm³", "density of the crystal";
    DENSITY_OF_FOUR = "density_of_four_chains", "g/cm³", "density with four chains per cell";
    ATOMS = "{cell}.atoms", "", "number of atoms";
    EDGE = "{cell}.edge_{axis}", "Å", "length of an edge";
    MONOMERS = "cell.monomers", "", "number of monomers per cell";
    BONDS = "cell.bonds", "", "number of covalent bonds per cell";
    CHAINS = "cell.chains", "", "number of chains per cell";
    ATOMS_WITH_BONDS = "{element}_with_{count}_bonds", "",
        "number of atoms of an element with this number of bonds";
    LEAST_ANGLE = "least_ch2_angle", "°", "smallest bond angle of a CH₂";
    GREATEST_ANGLE = "greatest_ch2_angle", "°", "largest bond angle of a CH₂";
    SHORTEST_BOND = "shortest_{pair}_bond", "Å", "shortest bond between two elements";
    LONGEST_BOND = "longest_{pair}_bond", "Å", "longest bond between two elements";
    TORSION = "amide_torsion_{number}", "°", "torsion beside the amide";
    GRID_RUNS = "grid.runs", "", "number of runs in the grid of loadings";
    GRID_SAMPLES = "grid.samples", "", "number of samples in these runs";
    LEAST_RATE = "grid.least_rate_{axis}", "1e-6 per step", "smallest strain rate";
    GREATEST_RATE = "grid.greatest_rate_{axis}", "1e-6 per step", "largest strain rate";
    GREATEST_STRAIN = "grid.greatest_strain_{axis}", "", "strain at the end of a run with the largest rate";
    STRAIN_IF_PER_FS = "grid.strain_if_per_fs_{axis}", "", "this strain if the published rates were per fs";
    HIDDEN_LAYERS = "{model}.hidden_layers", "", "number of hidden layers of a network of Table 3.4";
}

/// All scalars.
pub const ALL: &[&[harness::report::Quantity]] =
    &[DATA_QUANTITIES, MODEL_QUANTITIES, SEARCH_QUANTITIES, CRYSTAL_QUANTITIES];
