//! Scalars in reports of `polycore`.

harness::quantities! {
    /// Quantities of fits, `{fit}` = DATA.LAW or, for a fit judged on other data, DATA.LAW.OTHER; of
    /// fits with time; and of trials, `{trial}`.
    pub ALL:
    RMS = "{fit}.rms", "MPa", "root mean square of model − measurement";
    CHI = "{fit}.chi", "", "with standard deviations of the stresses: root of χ² over the degrees of \
                            freedom; far above 1, the law misses the tests";
    MAE = "{fit}.mae", "MPa", "mean of |model − measurement|";
    R2 = "{fit}.r2", "", "coefficient of determination 1 − Σr²/Σ(P − P̄)²";
    LOCKED = "{fit}.locked", "", "with `cross`: number of states of the other data beyond the locking \
                                  stretch of the law; if there are any, other values are missing";
    OUTSIDE = "{fit}.outside", "", "with `cross`: number of states of the other data out of \
                                    distribution, i.e. outside the strains that the data of the fit cover";
    STABLE = "{fit}.stable", "", "1 if the law is stable (Drucker) in uniaxial, equibiaxial and pure shear \
                                  tests over the stretches of its data, else 0";
    RANK = "{fit}.rank", "", "with `rank`: place of the law by its largest error in a mode left out";
    LEFT_OUT = "{fit}.left_out", "", "with `rank`: that largest error";
    MODE_LEFT_OUT = "{fit}.{mode}.left_out", "", "with `rank`: error in a mode of a fit to all others, \
                                                  rms over the largest stress of the mode";
    MODE_FITTED = "{fit}.{mode}.fitted", "", "with `rank`: error in a mode of the fit to all";
    MODE_ALONE = "{fit}.{mode}.alone", "", "with `rank`: largest error in the other modes of a fit to this \
                                            mode alone";
    FAILED = "{fit}.failed", "", "1 if the law could not be fitted; other values are missing";
    SHEAR_MODULUS = "{fit}.shear_modulus", "MPa", "shear modulus at rest";
    PARAMETER = "{fit}.{parameter}", "*", "parameter of the fitted law, stresses in MPa";
    STANDARD_ERROR = "{fit}.{parameter}.standard_error", "*", "standard error of the parameter";
    TIME_RMS = "time.{run}.rms", "MPa", "of a fit with time: root mean square of model − measurement; run \
                                        `all`: all runs, `left-out`: the rate left out";
    TIME_R2 = "time.{run}.r2", "", "of a fit with time: coefficient of determination";
    TIME_CONSTANT = "time.{constant}", "*", "constant of a law with time, stresses in MPa";
    REFUSED = "{trial}.refused", "", "1 if a trial was refused with the message of its scene, else 0";
    NOMINAL = "{trial}.nominal", "MPa", "P₁ of a trial with `parameters`";
    ENERGY = "{trial}.energy", "MJ/m³", "W of a trial with `parameters`";
}

harness::quantities! {
    /// Quantities of Prony series, `{prony}`; moduli are those measured, in tension or in shear.
    pub PRONY:
    TERMS = "{prony}.terms", "", "terms of the series";
    SERIES_RMS = "{prony}.rms", "", "root mean square of model/measurement − 1: relaxation modulus, or \
                                     storage modulus";
    LOSS_RMS = "{prony}.rms_loss", "", "root mean square of model/measurement − 1 of the loss modulus";
    EQUILIBRIUM = "{prony}.equilibrium", "MPa", "modulus after a long time";
    INSTANTANEOUS = "{prony}.instantaneous", "MPa", "modulus at once";
    WLF_FIRST = "{prony}.wlf_1", "", "WLF constant c₁ of isotherms above the reference";
    WLF_SECOND = "{prony}.wlf_2", "K", "WLF constant c₂";
    WLF_RMS = "{prony}.wlf_rms", "", "root mean square of its log₁₀ a_T minus those of the isotherms";
}

harness::quantities! {
    /// Quantities of tables of networks, `{network}`: deviations are predicted/measured − 1 of shear moduli.
    pub NETWORKS:
    PREDICTED = "{network}.predicted", "", "rows with a prediction";
    NOT_PREDICTED = "{network}.not_predicted", "", "rows to which the model does not apply";
    DEVIATION_MEAN = "{network}.deviation_mean", "", "mean of predicted/measured − 1";
    DEVIATION_MEDIAN = "{network}.deviation_median", "", "median of |predicted/measured − 1|";
    DEVIATION_RMS = "{network}.deviation_rms", "", "root mean square of predicted/measured − 1";
    DEVIATION_LARGEST = "{network}.deviation_largest", "", "largest |predicted/measured − 1|";
}

harness::quantities! {
    /// Quantities of foams, `{foam}` = NAME.LAW, by test.
    pub FOAMS:
    FOAM_RMS = "{foam}.{test}.rms", "MPa", "root mean square of model − measurement in a test";
    FOAM_RELATIVE = "{foam}.{test}.relative", "", "the same over the largest measured stress of the test";
    FOAM_END = "{foam}.{test}.end", "MPa", "stress of the law at the strain of the largest measured stress";
    FOAM_PREDICTED = "{foam}.{test}.predicted", "", "as `relative`, of a law fitted to the other tests";
}

harness::quantities! {
    /// Quantities of volumetric tests, `{volumetric}`.
    pub VOLUMETRIC:
    BULK = "{volumetric}.bulk_modulus", "MPa", "bulk modulus 2/D₁ of a volumetric test";
    BULK_ERROR = "{volumetric}.bulk_modulus.standard_error", "MPa", "its standard error";
    BULK_RMS = "{volumetric}.rms", "MPa", "root mean square of the pressure of the fit − measurement";
    COMPLIANCE = "{volumetric}.D{i}", "1/MPa", "Dᵢ of the energy Σ (J − 1)²ⁱ/Dᵢ";
    COMPLIANCE_ERROR = "{volumetric}.D{i}.standard_error", "1/MPa", "its standard error";
    MONOTONIC = "{volumetric}.monotonic", "", "1 if the pressure rises with compression in the test and \
                                               from J = 0.8 to 1.2, else 0";
}

harness::quantities! {
    /// Quantities of forecasts of curves, `{forecast}`.
    pub FORECASTS:
    FORECAST_CURVES = "{forecast}.curves_inside", "", "share of the curves that lie in their band as a whole";
    FORECAST_POINTS = "{forecast}.points_inside", "", "share of the predicted points that lie in the band";
    FORECAST_COVERAGE = "{forecast}.coverage", "", "share of whole curves that the band claims, \
                                                      1 − 2/n of n curves";
    FORECAST_WIDTH = "{forecast}.width", "", "median of the half width of the band at rupture, \
                                                relative: √(high/low) − 1";
    FORECAST_ERROR = "{forecast}.error", "", "root mean square of ln(predicted/measured) at rupture";
    FORECAST_LOCKING = "{forecast}.locking", "", "curves whose beginning and whole determine a \
                                                    locking stretch";
    FORECAST_LOCKING_INSIDE = "{forecast}.locking_inside", "", "share of these whose locking stretch \
                                                                  lies in its band";
    FORECAST_LOCKING_ABOVE = "{forecast}.locking_above", "", "share of the predicted locking \
                                                                stretches above rupture";
}
