use super::*;

fn si<D: Dimension>(text: &str) -> f64 {
    match text.parse::<Quantity<D>>() {
        Ok(quantity) => quantity.si(),
        Err(error) => panic!("{text}: {error}"),
    }
}

fn message<D: Dimension>(text: &str) -> String {
    text.parse::<Quantity<D>>().map(|q| q.si()).unwrap_err().to_string()
}

use dimension::*;

/// Factors by the definitions of the SI (BIPM, The International System of Units, 9th edition, 2019).
#[test]
fn definitions() {
    assert_eq!(si::<LengthDimension>("2 mm"), 0.002);
    assert_eq!(si::<LengthDimension>("2mm"), 0.002);
    for micro in ["1 um", "1 µm", "1 μm", "+1.0e0 um"] {
        assert_eq!(si::<LengthDimension>(micro), 1e-6);
    }
    assert_eq!(si::<StressDimension>("0.6 N/mm^2"), 0.6e6);
    assert_eq!(si::<StressDimension>("0.6 N/mm²"), 0.6e6);
    assert_eq!(si::<StressDimension>("0.6 MPa"), 0.6e6);
    assert_eq!(si::<StressDimension>("1e-3 MPa"), 1e3);
    assert_eq!(si::<StressDimension>("1 kg m^-1 s^-2"), 1.0);
    assert_eq!(si::<SpecificEnergyDimension>("200 J/g"), 200e3);
    assert_eq!(si::<RateDimension>("5e-5 /s"), 5e-5);
    assert_eq!(si::<RateDimension>("1/s"), 1.0);
    assert_eq!(si::<RateDimension>("3 s⁻¹"), 3.0);
    assert_eq!(si::<RateDimension>("60 1/min"), 1.0);
    assert_eq!(si::<EnergyPerAreaDimension>("2.67 N/mm"), 2670.0);
    assert_eq!(si::<EnergyPerAreaDimension>("5 kJ/m^2"), 5000.0);
    assert_eq!(si::<DensityDimension>("1.01 g/cm^3"), 1010.0);
    assert_eq!(si::<TimeDimension>("1 h"), 3600.0);
    assert_eq!(si::<VolumeDimension>("1 l"), 1e-3);
    assert_eq!(si::<ConductivityDimension>("0.25 W/(m K)"), 0.25);
    assert_eq!(si::<ConductivityDimension>("0.25 W/m/K"), 0.25);
    assert_eq!(si::<ConductivityDimension>("250 mW·m⁻¹·K⁻¹"), 0.25);
    assert_eq!(si::<HeatTransferDimension>("50 W/(m^2*K)"), 50.0);
    assert_eq!(si::<ForceDimension>("-2 kN"), -2000.0);
    assert_eq!(si::<SquaredTemperatureDimension>("136235 K^2"), 136_235.0);
    assert_eq!(si::<PerTemperatureDimension>("0.965 /K"), 0.965);
    assert_eq!(si::<MolarEnergyDimension>("6.27 kJ/mol"), 6270.0);
    assert_eq!(si::<MolarMassDimension>("113 g/mol"), 0.113);
    assert_eq!(si::<EnergyDimension>("1 N*m"), 1.0);
    assert_eq!(si::<EnergyDimension>("2 eV"), 2.0 * 1.602_176_634e-19);
    assert_eq!(si::<RatioDimension>("1 %"), 0.01);
    assert_eq!(si::<RatioDimension>("0.25"), 0.25);
    assert_eq!(si::<RatioDimension>("3 mm/m"), 0.003);
    assert!((si::<AngleDimension>("180 deg") - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(si::<LengthDimension>("0 mm"), 0.0);
    for angstrom in ["30 Å", "30 Angstrom", "30 angstrom"] {
        assert_eq!(si::<LengthDimension>(angstrom), 30e-10);
    }
    for (wrong, right) in [("3 Angstroms", "Å"), ("3 Micrometers", "µm"), ("3 kilometre", "km")] {
        assert!(message::<LengthDimension>(wrong).contains(&format!("did you mean `{right}`?")), "{wrong}");
    }
}

#[test]
fn temperatures() {
    assert_eq!(si::<TemperatureDimension>("220 degC"), 493.15);
    assert_eq!(si::<TemperatureDimension>("220 °C"), 493.15);
    assert_eq!(si::<TemperatureDimension>("493.15 K"), 493.15);
    assert_eq!(si::<TemperatureDimension>("-273.15 degC"), 0.0);
    assert!((si::<TemperatureDimension>("32 degF") - 273.15).abs() < 1e-12);
    assert_eq!(si::<TemperatureRateDimension>("60 K/min"), 1.0);
    assert!(message::<TemperatureDimension>("-1 K").contains("below absolute zero"));
    assert!(message::<TemperatureDimension>("-300 degC").contains("below absolute zero"));
    assert!(message::<TemperatureRateDimension>("10 degC/min").contains("use K"));
    assert!(message::<TemperatureDifferenceDimension>("10 degC").contains("use K"));
    assert!(message::<LengthDimension>("10 degC").contains("absolute temperatures only"));
}

#[test]
fn refusals_name_found_and_allowed() {
    assert_eq!(message::<LengthDimension>("2 kg"), "`2 kg` is a mass; a length is needed, e.g. \"2 mm\"");
    assert_eq!(message::<LengthDimension>("2"), "`2` has no unit; a length is needed, e.g. \"2 mm\"");
    assert_eq!(
        message::<LengthDimension>("2 1"),
        "`2 1` is a dimensionless number; a length is needed, e.g. \"2 mm\""
    );
    assert_eq!(message::<StressDimension>("2 mpa"), "unknown unit `mpa` in `2 mpa`; did you mean `MPa`?");
    assert_eq!(message::<TemperatureDimension>("220 C"), "unknown unit `C` in `220 C`; did you mean `degC`?");
    assert_eq!(
        message::<LengthDimension>("2 meters"),
        "unknown unit `meters` in `2 meters`; did you mean `m`?"
    );
    assert!(message::<LengthDimension>("3 kg^2 m/s^5").contains("a quantity in m kg^2 s^-5"));
    assert!(message::<SpecificHeatDimension>("2200 J/kg K").contains("use brackets"));
    assert!(message::<RatioDimension>("90 deg").contains("is an angle"));
    assert!(message::<AngleDimension>("1").contains("has no unit"));
    assert!(message::<LengthDimension>("1,5 mm").contains("decimals with a point"));
    assert!(message::<AreaDimension>("5 mm2").contains("write powers with `^`"));
    for (text, part) in [
        ("", "empty"),
        ("   ", "empty"),
        ("mm", "does not begin with a number"),
        ("-", "does not begin with a number"),
        ("1.2.3 mm", "unexpected `.`"),
        ("2 mm^", "a power is"),
        ("2 mm^0", "a power is"),
        ("2 mm^99999999999999", "a power is"),
        ("2 (mm", "not closed"),
        ("2 mm)", "unexpected `)`"),
        ("2 mm/", "ends where a unit"),
        ("2 m^12 m^12", "too large"),
        ("2 ((((((((((m))))))))))", "too many brackets"),
        ("2 💩", "unexpected"),
        ("nan mm", "not a finite number"),
        ("-inf mm", "not a finite number"),
        ("1e400 mm", "not a finite number"),
        ("1e308 km", "too large"),
        ("1e-307 nm", "too small"),
    ] {
        let found = message::<LengthDimension>(text);
        assert!(found.contains(part), "{text:?} gives {found:?}");
    }
    assert!(message::<LengthDimension>(&format!("2 {}", "m ".repeat(1000))).contains("too long"));
}

/// A symbol means the same whatever the quantity it is listed under, apart from the known homographs.
#[test]
fn symbols_are_unambiguous() {
    for text in super::table::symbols() {
        assert!(
            super::table::symbol(text).is_some_and(|(f, _)| f.iter().all(|f| f.is_finite() && *f > 0.0)),
            "{text}"
        );
    }
    for (text, kind) in [
        ("min", TimeDimension::EXPONENTS),
        ("d", TimeDimension::EXPONENTS),
        ("h", TimeDimension::EXPONENTS),
        ("t", MassDimension::EXPONENTS),
        ("Pa", StressDimension::EXPONENTS),
        ("g", MassDimension::EXPONENTS),
        ("T", [0; 8]),
    ] {
        let found = super::table::symbol(text).map_or([0; 8], |(_, exponents)| exponents);
        assert_eq!(found, kind, "{text}");
    }
}

#[test]
fn serde_round_trip() {
    #[derive(serde::Deserialize, serde::Serialize, PartialEq, Debug)]
    struct Body {
        spacing: Length,
        porosity: Ratio,
    }
    let body: Body = toml::from_str("spacing = '2 mm'\nporosity = 0.5").unwrap();
    assert_eq!((body.spacing.si(), body.porosity.si()), (0.002, 0.5));
    let text = toml::to_string(&body).unwrap();
    assert_eq!(toml::from_str::<Body>(&text).unwrap(), body);
    for bad in ["spacing = 2\nporosity = 0", "spacing = 2.5\nporosity = 0"] {
        let error = toml::from_str::<Body>(bad).unwrap_err();
        assert!(error.message().contains("has no unit; a length is needed"), "{error}");
    }
    assert!(
        toml::from_str::<Body>("spacing = '1 m'\nporosity = inf")
            .unwrap_err()
            .message()
            .contains("not a finite")
    );
    assert!(
        toml::from_str::<Body>("spacing = true\nporosity = 0")
            .unwrap_err()
            .message()
            .contains("a length with its unit")
    );
}

proptest::proptest! {
    /// No text may cause a panic, and every parsed number is finite.
    #[test]
    fn never_panics(text in "\\PC{0,40}", number in proptest::num::f64::ANY) {
        for candidate in [text.clone(), format!("{number:e} {text}"), format!("2 {text}^2")] {
            if let Ok(length) = candidate.parse::<Length>() {
                proptest::prop_assert!(length.si().is_finite());
            }
        }
    }

    /// A value written in SI and read again keeps its bits.
    #[test]
    fn display_round_trip(value in proptest::num::f64::NORMAL) {
        let stress = Stress::from_si(value);
        let read: Stress = stress.to_string().parse().unwrap();
        proptest::prop_assert_eq!(read.si().to_bits(), value.to_bits());
    }
}
