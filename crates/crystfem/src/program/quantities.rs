//! The scalars that reports of `crystfem` can have. Those of a study have its name and a dot before them.

harness::quantities! {
    /// Of parts; `{field}` is `temperature`, `alpha` or another field of a material, `{layer}` nothing or `layer-N.`.
    pub OF_PARTS:
    STORED_ENERGY = "stored_energy", "J", "change of the stored energy since the start";
    EXCHANGED_ENERGY = "exchanged_energy", "J", "heat that came through surfaces and from sources";
    REACTION_ENERGY = "reaction_energy", "J", "heat that prescribed temperatures brought";
    BIRTH_ENERGY = "birth_energy", "J", "energy of the elements that appeared";
    HEAT_GIVEN_OFF = "heat_given_off", "J", "heat that left: exchanged and reaction energy, with the other sign";
    MISSING_ENERGY = "missing_energy", "J", "stored energy less all that came in";
    WORST_BALANCE = "worst_balance", "", "largest error of the balance in a step, over the energy that moved";
    PRINTED_VOLUME = "printed_volume", "m^3", "of a mesh of a path or an STL surface: volume of what exists at the end, each element as far as it is filled";
    CELLS_OVER_BODY = "cells_over_body", "", "volume of its cells over that of the body";
    PATH_TIME = "path_time", "s", "how long its path takes, waits for temperatures left out";
    FILAMENT = "filament", "m", "filament that its printing moves feed";
    WARPAGE = "warpage", "m", "with `[mechanics]`: by how much the side of the bed is out of flat at the end, about its least-squares plane";
    LARGEST_DISPLACEMENT = "largest_displacement", "m", "with `[mechanics]`: at the end";
    MISES_ON_BED = "largest_mises_on_bed", "Pa", "with `[mechanics]`: largest Mises stress at the end, before the release";
    MISES = "largest_mises", "Pa", "with `[mechanics]`: largest Mises stress after the release";
    MISES_OVER_STRENGTH = "largest_mises_over_strength", "", "with `[mechanics]`: largest Mises stress, before or after the release, over the strength of sheets; there is no plasticity";
    LARGEST_ROTATION = "largest_rotation", "rad", "with `[mechanics]`: largest rotation of an element since it was melt; θ looks like a strain of θ²/2";
    STRESS_WORK = "stress_work", "J", "with `[mechanics]`: work of the stress on the strain without the free strain, over all steps";
    STRESS_STORED = "stress_stored", "J", "with `[mechanics]`: elastic energy at the end";
    STRESS_LOST = "stress_lost", "J", "with `[mechanics]`: what relaxed, was lost with crystals that melt, or because new ones are born without stress";
    STRESS_HARDENING = "stress_hardening", "J", "with `[mechanics]`: by how much the stored energy grew because the network hardens when it cools, less what softening took";
    WORST_STRESS_BALANCE = "worst_stress_balance", "", "with `[mechanics]`: largest |work + hardening − stored − lost| of a step over the energies it moved and those stored";
    LEAST_HEALING = "least_healing", "", "with `[healing]`: least degree of healing D_h of an interface between births";
    MEAN_HEALING = "mean_healing", "", "with `[healing]`: its mean by area";
    LEAST_INTERLAYER_STRENGTH = "least_interlayer_strength", "MPa", "with `healing.strength`: least strength of an interface, D_h times that of the material";
    MEAN_INTERLAYER_STRENGTH = "mean_interlayer_strength", "MPa", "with `healing.strength`: its mean by area";
    MEAN = "{layer}mean_{field}", "*", "mean by volume at the end, of the part or of a layer";
    LEAST = "{layer}least_{field}", "*", "smallest value at a node";
    LARGEST = "{layer}largest_{field}", "*", "largest value at a node";
    DEVIATION = "{layer}deviation_of_{field}", "*", "standard deviation by volume";
    DISTANCE = "{probe}.distance", "m", "distance of a probe from the mesh; 0 inside";
    AT_PROBE = "{probe}.{field}", "*", "value at a probe at the end";
    DISPLACEMENT = "{probe}.displacement_{axis}", "m", "with `[mechanics]`: displacement of a probe at the end; `{axis}` is x, y or z";
    LOWEST_TEMPERATURE = "{probe}.lowest_temperature", "degC", "lowest temperature at a probe";
    HIGHEST_TEMPERATURE = "{probe}.highest_temperature", "degC", "highest temperature at a probe";
    JUMP = "{probe}.jump_at_birth_{number}", "K", "rise of the temperature after a birth, before the next one";
    AT_BIRTH = "{probe}.{field}_at_birth_{number}", "", "value of a field just before a birth";
    LOST_AT_BIRTH = "{probe}.{field}_lost_at_birth_{number}", "", "by how much it falls after the birth";
    FAILED_AS_EXPECTED = "{study}.failed_as_expected", "", "1 if a study with `expect_error` ended with this error, else 0";
}

harness::quantities! {
    /// Of points; `{point}` is the point's name or, with several materials, POINT.MATERIAL.
    pub OF_POINTS:
    NON_FINITE_ROWS = "{point}.non_finite_rows", "", "rows with a value that is not finite, where the scene expects some";
    COLDEST = "{point}.lowest_temperature", "degC", "lowest temperature";
    HOTTEST = "{point}.highest_temperature", "degC", "highest temperature";
    FINAL_TEMPERATURE = "{point}.final_temperature", "degC", "temperature at the end";
    TEMPERATURE_RISE = "{point}.temperature_rise", "K", "temperature at the end less that at the start";
    ENERGY_CHANGE = "{point}.energy_change", "J/kg", "internal energy at the end less that at the start";
    LOWEST = "{point}.lowest_{field}", "", "smallest value of a field";
    HIGHEST = "{point}.highest_{field}", "", "largest value of a field";
    FINAL = "{point}.final_{field}", "", "value of a field at the end";
    FIRST_STEP = "{point}.first_step_{field}", "", "value of a field after the first step";
    TEMPERATURE_AT = "{point}.temperature_at_{event}", "degC", "temperature at which α reaches a value, or at the `peak` of its rate";
    TIME_TO = "{point}.time_to_{event}", "s", "time from the start to it";
    PEAK_RATE = "{point}.peak_rate", "1/s", "largest dα/dt";
    NODES_LEAST = "{nodes}.least_{field}", "", "of `[[nodes]]`: smallest value of a field at the end";
    NODES_MEAN = "{nodes}.mean_{field}", "", "mean over the nodes, not weighted";
    NODES_LARGEST = "{nodes}.largest_{field}", "", "largest value";
    NODES_COLDEST_AT = "{nodes}.least_temperature_at_{degree}", "degC", "of `[[nodes]]` all of which reach it: lowest temperature at which a node reaches a value of α";
    NODES_MEAN_AT = "{nodes}.mean_temperature_at_{degree}", "degC", "mean over the nodes, not weighted";
    NODES_HOTTEST_AT = "{nodes}.largest_temperature_at_{degree}", "degC", "highest";
    SHIFT_AT = "{point}.shift_at_{degree}", "K", "temperature at a value of α, of one material less that of another";
    LONGER_TO = "{point}.longer_to_{degree}", "", "time to a value of α, of one material over that of another, less 1";
}

harness::quantities! {
    /// Of fits.
    pub OF_FITS:
    CONSTANT = "{fit}.{constant}", "*", "a fitted constant";
    STANDARD_ERROR = "{fit}.{constant}.standard_error", "*", "its standard error";
    LOWER = "{fit}.{constant}.lower", "*", "lower end of its 95 % confidence interval";
    UPPER = "{fit}.{constant}.upper", "*", "upper end of it";
    ENTHALPY = "{fit}.run-{number}.enthalpy", "J/g", "of heat flows: area of the peak over its baseline, file by file";
    CRYSTALLINITY = "{fit}.run-{number}.crystallinity", "", "this enthalpy over the `latent_heat` of the perfect crystal";
    FIT_RMS = "{fit}.rms", "", "root mean square of the residuals";
}

/// All of them.
pub const ALL: &[&[harness::report::Quantity]] = &[OF_PARTS, harness::study::OF_STUDIES, OF_POINTS, OF_FITS];
