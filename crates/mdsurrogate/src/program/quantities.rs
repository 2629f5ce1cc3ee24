//! The scalars that reports of `mdsurrogate` can have.

harness::quantities! {
    /// Of data; those of held-out runs begin with `heldout.`.
    pub OF_DATA:
    ROWS = "rows", "", "rows of the data";
    PATHS = "paths", "", "runs of the data";
    SKIPPED_ROWS = "skipped_rows", "", "rows left out, as the scene asks";
    DUPLICATE_ROWS = "duplicate_rows", "", "rows that are equal to an earlier one";
    CONSTANT_COMPONENTS = "constant_components", "", "components of C that never change";
    PATHS_OF_KIND = "paths_of_kind_{kind}", "", "runs of a kind of loading";
    LEAST_C = "least_c{component}", "", "smallest value of a component of C";
    GREATEST_C = "greatest_c{component}", "", "largest value of a component of C";
    LEAST_PRINCIPAL_STRETCH = "least_principal_stretch", "", "smallest principal stretch of any row";
    GREATEST_PRINCIPAL_STRETCH = "greatest_principal_stretch", "", "largest principal stretch of any row";
    NOISE = "noise_{stress}{component}", "MPa", "standard deviation of the noise of a component, from neighbouring rows";
    NOISE_FLOOR = "noise_floor_{stress}", "MPa²", "error (3.12) of a perfect model, from the noise";
    LAG_1 = "lag_1_correlation_{stress}", "", "correlation of the noise of neighbouring rows";
    LAG_1_IF_WHITE = "lag_1_correlation_{stress}_if_white", "", "the same of white noise";
    SET_ROWS = "{set}.rows", "", "rows of the training, validation and test set";
    TRAINING_MEAN = "training.mean_c{component}", "", "mean of a component of C in training";
    TRAINING_DEVIATION = "training.deviation_c{component}", "", "standard deviation of a component of C in training";
    NEAREST_TRAINING_ROW = "test.nearest_training_row", "", "median distance of a test row from the nearest training row, in standard deviations";
    NEAREST_OTHER_ROW = "training.nearest_other_row", "", "the same of training rows from each other";
    NEIGHBOURS_OF_RUN = "test.neighbours_of_their_run", "", "share of test rows whose nearest training row is of their own run";
    LEAK_RATIO = "leak_ratio", "", "distance of test rows from the nearest training row over that between training rows: about 1 for randomly split rows, larger where runs are kept whole";
    MODULUS = "modulus_{axis}", "GPa", "slope of σ over strains of 0.02 to 0.08 in the uniaxial runs (kinds `ux`, `uy`, `uz`)";
    PEAK_STRESS = "peak_stress_{axis}", "GPa", "largest mean of five samples of σ in a direction";
    PEAK_STRAIN = "peak_strain_{axis}", "", "engineering strain there";
    STIFFENING = "stiffening_{axis}", "", "slope over strains of 0.12 to 0.20 over that of 0.04 to 0.12";
    MODULUS_RATIO = "modulus_z_over_{axis}", "", "modulus in z over that in another direction";
    PEAK_STRAIN_RATIO = "peak_strain_{axis}_over_z", "", "strain at the peak in a direction over that in z";
}

harness::quantities! {
    /// Of models; `{set}` is `training`, `validation`, `test`, `heldout.RUN`, `run.RUN` or `all_runs`.
    pub OF_MODELS:
    PARAMETERS = "{model}.parameters", "", "parameters of a network, of one member";
    SPREAD_LIMIT = "{model}.spread_limit", "MPa", "largest spread of an ensemble on its training rows; predictions above it are flagged";
    BEST_EPOCH = "{model}.best_epoch", "", "epoch with the lowest validation loss";
    MEMBER_BEST_EPOCH = "{model}.member_{number}.best_epoch", "", "the same of a member of an ensemble";
    MEAN_SQUARE_ERROR = "{model}.{set}.mean_square_error", "MPa²", "mean over the rows of the sum of squares over the six components, Eq. (3.12)";
    COMPONENT_ERROR = "{model}.{set}.error_per_component", "MPa²", "a sixth of it, as Keras reports";
    PERCENTAGE_ERROR = "{model}.{set}.percentage_error", "%", "mean of |S − Ŝ|/|S|, Eq. (3.13), the error measure of the thesis; the model `zero_stress` predicts S = 0 (100 %), `noise` is the lower bound that the noise sets";
    SHARE_OUTSIDE = "{model}.{set}.share_outside_training", "", "share of rows outside the box of the training data";
    ERROR_OVER_NOISE = "{model}.{set}.error_over_noise", "", "mean square error over the variance of the noise of single rows; 1 is the minimum for any model";
    ERROR_WITHOUT_SOFTENING = "{model}.{set}.error_without_softening", "", "mean square error of the energy alone over that with its damage variable, on held-out runs";
    SHARE_BADLY_WRONG = "{model}.{set}.share_badly_wrong", "", "share of rows with an error above a tenth of the stress and three times the noise";
    CAUGHT_BY = "{model}.{set}.caught_by_{flag}", "", "share of these rows with a flag: `any_flag`, `box`, `distance` or `spread`";
    FALSE_ALARMS = "{model}.{set}.false_alarms_of_{flag}", "", "share of the other rows with this flag";
    RANK_CORRELATION = "{model}.{set}.rank_correlation", "", "Spearman's rank correlation of spread and error, of an ensemble";
    WITHIN = "{model}.{set}.share_within_{count}_std_of_s{component}", "", "of an ensemble: share of rows whose measured component lies within `1` or `2` of its standard deviations from the predicted one; normal errors give 0.683 and 0.954";
    SHARE_FLAGGED = "{model}.{set}.share_flagged", "", "of nominal stresses: share of rows with any flag";
    MEAN_ABSOLUTE_ERROR = "{model}.{set}.mean_absolute_error", "MPa", "mean of |P − P̂| over the measured stresses";
    RMS = "{model}.{set}.rms", "MPa", "root mean square of P − P̂ over the measured stresses";
    R2 = "{model}.{set}.r2", "", "1 − Σ(P − P̂)²/Σ(P − P̄)² over the measured stresses";
    UNSEEN_ERROR_RATIO = "{model}.unseen_error_over_{other}", "", "error on validation and test rows over that of the same network with the scene's split";
    STRESS_AT_REST = "{model}.stress_at_rest", "MPa", "‖S(I)‖";
    ASYMMETRY = "{model}.tangent_asymmetry", "", "‖ℂ − ℂᵀ‖/‖ℂ‖, mean over the test rows";
    LARGEST_ASYMMETRY = "{model}.largest_tangent_asymmetry", "", "the same, largest of the test rows";
    CYCLE = "{model}.work_of_a_closed_cycle", "", "|∮ S:dC/2| over ∮ |S:dC/2| around a rectangle in C₁₁ and C₃₃, from I to half of the training box";
    OBJECTIVITY = "{model}.lack_of_objectivity", "", "largest ‖σ(RF) − R σ(F) Rᵀ‖/‖σ(F)‖";
    LEAST_WAVE = "{model}.least_acoustic_eigenvalue", "MPa", "smallest eigenvalue of the acoustic tensor over the directions and up to 500 training strains; below zero the law has lost its ellipticity";
    LEAST_WAVE_AT = "{model}.least_acoustic_eigenvalue_at_c{component}", "", "component of C there";
    NOT_ELLIPTIC = "{model}.share_not_elliptic", "", "share of these strains at which the law has lost its ellipticity";
    UNSEEN_SHEAR = "{model}.unseen_shear_stress", "MPa", "shear stress in simple shears of 0.05, where the data have no shear";
    SHEAR_FLAGGED = "{model}.share_of_shear_flagged", "", "share of these shears that are flagged as unseen";
    BINNED = "{model}.heldout.percentage_error_c{component}_{from}_to_{to}", "%", "mean of (3.13) over all held-out runs pulled along an axis, between two values of C";
    AS_EXPECTED = "{trial}.as_expected", "", "1 if a trial ended as its scene expects, else 0";
}

harness::quantities! {
    /// Of searches; `{method}` is `random`, `hyperband` or `bayesian`.
    pub OF_SEARCHES:
    CANDIDATES = "candidates", "", "candidates that were trained";
    DIVERGED = "diverged_candidates", "", "those whose loss is not finite";
    BEST_LOSS = "{method}.best_validation_loss", "MPa²", "lowest validation loss of a method";
    MEDIAN_LOSS = "{method}.median_validation_loss", "MPa²", "median of that over seeds";
    WORST_LOSS = "{method}.worst_validation_loss", "MPa²", "highest of that over seeds";
    MEDIAN_EPOCHS = "{method}.median_epochs", "", "median epochs of a search over seeds";
    LOSS_OVER_RANDOM = "{method}.loss_over_random", "", "median loss of a method over that of random search";
    CHOSEN_PARAMETERS = "chosen.parameters", "", "parameters of the chosen candidate";
    CHOSEN_LOSS = "chosen.validation_loss", "MPa²", "its validation loss";
}

harness::quantities! {
    /// Of the crystal and of the grid of runs; `{cell}` is `cell` or `supercell`.
    pub OF_CRYSTALS:
    DENSITY = "density", "g/cm³", "density of the crystal";
    DENSITY_OF_FOUR = "density_of_four_chains", "g/cm³", "density with four chains in a cell";
    ATOMS = "{cell}.atoms", "", "atoms";
    EDGE = "{cell}.edge_{axis}", "Å", "length of an edge";
    MONOMERS = "cell.monomers", "", "monomers in a cell";
    BONDS = "cell.bonds", "", "covalent bonds in a cell";
    CHAINS = "cell.chains", "", "chains in a cell";
    ATOMS_WITH_BONDS = "{element}_with_{count}_bonds", "", "atoms of an element with so many bonds";
    LEAST_ANGLE = "least_ch2_angle", "°", "smallest angle of two bonds of a CH₂";
    GREATEST_ANGLE = "greatest_ch2_angle", "°", "largest angle of two bonds of a CH₂";
    SHORTEST_BOND = "shortest_{pair}_bond", "Å", "shortest bond of two elements";
    LONGEST_BOND = "longest_{pair}_bond", "Å", "longest bond of two elements";
    TORSION = "amide_torsion_{number}", "°", "torsion beside the amide";
    GRID_RUNS = "grid.runs", "", "runs of the grid of loadings";
    GRID_SAMPLES = "grid.samples", "", "samples of these runs";
    LEAST_RATE = "grid.least_rate_{axis}", "1e-6 per step", "smallest strain rate";
    GREATEST_RATE = "grid.greatest_rate_{axis}", "1e-6 per step", "largest strain rate";
    GREATEST_STRAIN = "grid.greatest_strain_{axis}", "", "strain that the largest rate reaches";
    STRAIN_IF_PER_FS = "grid.strain_if_per_fs_{axis}", "", "strain if the published rates were per fs";
    HIDDEN_LAYERS = "{model}.hidden_layers", "", "hidden layers of a network of Table 3.4";
}

/// All of them.
pub const ALL: &[&[harness::report::Quantity]] = &[OF_DATA, OF_MODELS, OF_SEARCHES, OF_CRYSTALS];
