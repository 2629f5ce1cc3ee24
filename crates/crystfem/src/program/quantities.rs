//! Scalars in the reports of `crystfem`. Values of a study are prefixed by its name and a dot.

harness::quantities! {
    /// Scalars of parts; `{field}` is `temperature`, `alpha` or another material field, `{layer}` is empty or
    /// `layer-N.`.
    pub PART_QUANTITIES:
    STORED_ENERGY = "stored_energy", "J", "change of the stored energy since the start";
    EXCHANGED_ENERGY = "exchanged_energy", "J", "heat received through surfaces and from sources";
    REACTION_ENERGY = "reaction_energy", "J", "heat supplied by prescribed temperatures";
    BIRTH_ENERGY = "birth_energy", "J", "energy of the elements added by printing";
    HEAT_GIVEN_OFF = "heat_given_off", "J", "heat released: minus the sum of exchanged and reaction energy";
    MISSING_ENERGY = "missing_energy", "J",
        "error of the energy balance: stored energy minus all energy supplied";
    WORST_BALANCE = "worst_balance", "", "largest relative error of the energy balance in a step";
    PRINTED_VOLUME = "printed_volume", "m^3",
        "for a mesh from a path or STL surface: volume of the elements at the end, times their filled \
         fractions";
    CELLS_OVER_BODY = "cells_over_body", "", "for the same meshes: volume of the cells over that of the body";
    PATH_TIME = "path_time", "s", "duration of the tool path, without waits for temperatures";
    FILAMENT = "filament", "m", "filament length fed by the printing moves";
    WARPAGE = "warpage", "m",
        "with `[mechanics]`: flatness error of the bed side at the end, about its least-squares plane";
    LARGEST_DISPLACEMENT = "largest_displacement", "m", "with `[mechanics]`: largest displacement at the end";
    MISES_ON_BED = "largest_mises_on_bed", "Pa",
        "with `[mechanics]`: largest Mises stress before the release";
    MISES = "largest_mises", "Pa", "with `[mechanics]`: largest Mises stress at the end, after the release";
    WARPAGE_AT_RELEASE = "warpage_at_release", "m",
        "with `mechanics.release_at`: flatness error right after the release";
    MISES_AT_RELEASE = "largest_mises_at_release", "Pa",
        "with `mechanics.release_at`: largest Mises stress right after the release";
    COMPENSATION_RESIDUAL = "compensation_residual", "",
        "with `mechanics.compensation`: largest distance of a node of the compensated print from its nominal \
         place, over the largest displacement without compensation";
    MISES_OVER_STRENGTH = "largest_mises_over_strength", "",
        "with `[mechanics]`: largest Mises stress, before or after the release, over the tensile strength of \
         sheets; plasticity is not modelled";
    LARGEST_ROTATION = "largest_rotation", "rad",
        "with `[mechanics]`: largest rotation of an element since it was molten; a rotation θ gives a false \
         strain of θ²/2";
    STRESS_WORK = "stress_work", "J",
        "with `[mechanics]`: work of the stress on the strain minus the free strain, over all steps";
    STRESS_STORED = "stress_stored", "J", "with `[mechanics]`: elastic energy at the end";
    STRESS_LOST = "stress_lost", "J",
        "with `[mechanics]`: elastic energy lost by relaxation, melting crystals and stress-free new \
         crystals";
    STRESS_HARDENING = "stress_hardening", "J",
        "with `[mechanics]`: elastic energy gained by hardening of the network on cooling, minus that lost \
         by softening";
    WORST_STRESS_BALANCE = "worst_stress_balance", "",
        "with `[mechanics]`: largest |work + hardening − stored − lost| in a step, relative to the energies \
         of the step";
    LEAST_HEALING = "least_healing", "",
        "with `[healing]`: smallest degree of healing D_h of an interface between births";
    MEAN_HEALING = "mean_healing", "", "with `[healing]`: mean degree of healing, weighted by area";
    LEAST_INTERLAYER_STRENGTH = "least_interlayer_strength", "MPa",
        "with `healing.strength`: smallest strength of an interface, D_h times the strength of the material";
    MEAN_INTERLAYER_STRENGTH = "mean_interlayer_strength", "MPa",
        "with `healing.strength`: mean strength, weighted by area";
    MEAN = "{layer}mean_{field}", "*", "mean at the end, weighted by volume, of the part or of a layer";
    LEAST = "{layer}least_{field}", "*", "smallest nodal value";
    LARGEST = "{layer}largest_{field}", "*", "largest nodal value";
    DEVIATION = "{layer}deviation_of_{field}", "*", "standard deviation, weighted by volume";
    DISTANCE = "{probe}.distance", "m", "distance of a probe from the mesh; 0 inside";
    AT_PROBE = "{probe}.{field}", "*", "value at a probe at the end";
    DISPLACEMENT = "{probe}.displacement_{axis}", "m",
        "with `[mechanics]`: displacement of a probe at the end; `{axis}` is x, y or z";
    LOWEST_TEMPERATURE = "{probe}.lowest_temperature", "degC", "lowest temperature at a probe";
    HIGHEST_TEMPERATURE = "{probe}.highest_temperature", "degC", "highest temperature at a probe";
    JUMP = "{probe}.jump_at_birth_{number}", "K", "rise of the temperature between a birth and the next one";
    AT_BIRTH = "{probe}.{field}_at_birth_{number}", "", "value of a field just before a birth";
    LOST_AT_BIRTH = "{probe}.{field}_lost_at_birth_{number}", "",
        "largest drop of a field between a birth and the next one";
    FAILED_AS_EXPECTED = "{study}.failed_as_expected", "",
        "1 if a study with `expect_error` ended with this error, otherwise 0";
}

harness::quantities! {
    /// Scalars of points; `{point}` is the name of the point or, with several materials, POINT.MATERIAL.
    pub POINT_QUANTITIES:
    NON_FINITE_ROWS = "{point}.non_finite_rows", "",
        "number of rows with a non-finite value, if the scene expects such rows";
    COLDEST = "{point}.lowest_temperature", "degC", "lowest temperature";
    HOTTEST = "{point}.highest_temperature", "degC", "highest temperature";
    FINAL_TEMPERATURE = "{point}.final_temperature", "degC", "temperature at the end";
    TEMPERATURE_RISE = "{point}.temperature_rise", "K", "temperature at the end minus that at the start";
    ENERGY_CHANGE = "{point}.energy_change", "J/kg", "internal energy at the end minus that at the start";
    LOWEST = "{point}.lowest_{field}", "", "smallest value of a field";
    HIGHEST = "{point}.highest_{field}", "", "largest value of a field";
    FINAL = "{point}.final_{field}", "", "value of a field at the end";
    FIRST_STEP = "{point}.first_step_{field}", "", "value of a field after the first step";
    TEMPERATURE_AT = "{point}.temperature_at_{event}", "degC",
        "temperature at which α reaches a value, or at the `peak` of its rate";
    TIME_TO = "{point}.time_to_{event}", "s", "time from the start to that event";
    PEAK_RATE = "{point}.peak_rate", "1/s", "largest dα/dt";
    NODES_LEAST = "{nodes}.least_{field}", "", "for `[[nodes]]`: smallest value of a field at the end";
    NODES_MEAN = "{nodes}.mean_{field}", "", "for `[[nodes]]`: unweighted mean over the nodes";
    NODES_LARGEST = "{nodes}.largest_{field}", "", "for `[[nodes]]`: largest value of a field at the end";
    NODES_COLDEST_AT = "{nodes}.least_temperature_at_{degree}", "degC",
        "for `[[nodes]]`, if all nodes reach this α: lowest temperature at which a node reaches it";
    NODES_MEAN_AT = "{nodes}.mean_temperature_at_{degree}", "degC",
        "for `[[nodes]]`: unweighted mean of these temperatures";
    NODES_HOTTEST_AT = "{nodes}.largest_temperature_at_{degree}", "degC",
        "for `[[nodes]]`: highest of these temperatures";
    SHIFT_AT = "{point}.shift_at_{degree}", "K", "temperature at a value of α: one material minus the other";
    LONGER_TO = "{point}.longer_to_{degree}", "",
        "time to a value of α: one material over the other, minus 1";
}

harness::quantities! {
    /// Scalars of fits.
    pub FIT_QUANTITIES:
    CONSTANT = "{fit}.{constant}", "*", "fitted constant";
    STANDARD_ERROR = "{fit}.{constant}.standard_error", "*", "standard error of the constant";
    LOWER = "{fit}.{constant}.lower", "*", "lower end of the 95 % confidence interval";
    UPPER = "{fit}.{constant}.upper", "*", "upper end of the 95 % confidence interval";
    ENTHALPY = "{fit}.run-{number}.enthalpy", "J/g",
        "for heat flows: area of the peak above its baseline, for each file";
    CRYSTALLINITY = "{fit}.run-{number}.crystallinity", "",
        "for heat flows: enthalpy over the `latent_heat` of the perfect crystal";
    FIT_RMS = "{fit}.rms", "", "root mean square of the residuals";
    PREDICTED = "{fit}.prediction-{number}.temperature_at_{degree}", "degC",
        "for `predict`: temperature at which α reaches 0.05, 0.1, 0.25, 0.5, 0.75, 0.9 or 0.95";
}

/// All scalars.
pub const ALL: &[&[harness::report::Quantity]] =
    &[PART_QUANTITIES, harness::study::OF_STUDIES, POINT_QUANTITIES, FIT_QUANTITIES];
