//! Typed physical quantities at the borders of the programs: `"0.6 N/mm^2"` in a scene becomes an SI `f64`.
//!
//! A scene type declares `spacing: Length`; reading `"2 kg"` there fails with a message that names what was
//! found and what is needed. Inside the solvers there are no units: [`Quantity::si`] gives the plain `f64`.
//!
//! Symbols, factors and dimensions come from [`uom`]; the grammar on top allows products (`N*mm`, `N·mm`,
//! `N mm`), quotients (`J/(kg K)`), powers (`mm^2`, `mm²`, `s^-1`) and `u` for `µ`. `J/kg K` is ambiguous and
//! refused.

use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};

mod error;
mod grammar;
mod table;

pub use error::UnitError;

/// Exponents of length, mass, time, current, temperature, amount, luminous intensity, and plane angle
/// (which SI counts as dimensionless; kept apart so that a strain cannot be read as an angle).
pub type Exponents = [i8; 8];

/// Kind of quantity, by its dimension.
pub trait Dimension {
    /// The powers of the base dimensions.
    const EXPONENTS: Exponents;
    /// Name with its article, as error messages use it: `a length`.
    const NAME: &'static str;
    /// A valid input, as error messages show it.
    const EXAMPLE: &'static str;
    /// Symbol of the coherent SI unit, in which [`Quantity::si`] counts.
    const UNIT: &'static str;
    /// An absolute temperature: `degC` is allowed and the value may not lie below absolute zero.
    const ABSOLUTE_TEMPERATURE: bool = false;
}

/// A value in coherent SI units together with its dimension `D`.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct Quantity<D> {
    si: f64,
    dimension: PhantomData<D>,
}

impl<D: Dimension> Quantity<D> {
    /// Symbol of the SI unit of this quantity.
    pub const UNIT: &'static str = D::UNIT;

    /// Creates a quantity from a value in SI units.
    pub const fn from_si(si: f64) -> Self {
        Self { si, dimension: PhantomData }
    }

    /// Value in coherent SI units.
    pub const fn si(self) -> f64 {
        self.si
    }
}

impl<D: Dimension> FromStr for Quantity<D> {
    type Err = UnitError;

    /// Reads `NUMBER UNIT`.
    ///
    /// # Errors
    /// Every departure from the grammar, an unknown unit, another dimension than `D`, and numbers that are
    /// not finite or that over- or underflow in SI units.
    fn from_str(text: &str) -> Result<Self, UnitError> {
        let (number, unit) = grammar::split_number(text)?;
        if !number.is_finite() {
            return Err(UnitError::Range { text: text.trim().into(), problem: "is not a finite number" });
        }
        Unit::<D>::within(unit, text)?.quantity(number)
    }
}

/// Unit of a dimension `D`, read once and then used for many numbers, e.g. a column of a table.
#[derive(Clone, Debug)]
pub struct Unit<D> {
    text: String,
    numerator: f64,
    denominator: f64,
    zero: f64,
    dimension: PhantomData<D>,
}

impl<D: Dimension> Unit<D> {
    /// Reads a unit; the empty text is the unit of dimensionless numbers.
    ///
    /// # Errors
    /// An unknown unit, another dimension than `D`, no unit if one is needed.
    pub fn parse(unit: &str) -> Result<Self, UnitError> {
        Self::within(unit.trim(), unit)
    }

    /// Reads the unit at the end of a text; errors show the whole text.
    fn within(unit: &str, whole: &str) -> Result<Self, UnitError> {
        let new = |numerator, denominator, zero| Self {
            text: unit.to_owned(),
            numerator,
            denominator,
            zero,
            dimension: PhantomData,
        };
        if unit.is_empty() && D::EXPONENTS != [0; 8] {
            return Err(UnitError::bare::<D>(whole.trim()));
        }
        match (table::affine(unit), D::ABSOLUTE_TEMPERATURE) {
            (Some((factor, zero)), true) => Ok(new(factor, 1.0, zero)),
            (Some(_), false) => Err(UnitError::affine(whole.trim(), unit)),
            (None, _) => {
                let (numerator, denominator, exponents) = grammar::unit(unit, whole)?;
                match exponents == D::EXPONENTS {
                    true => Ok(new(numerator, denominator, 0.0)),
                    false => Err(UnitError::dimension::<D>(whole.trim(), exponents)),
                }
            }
        }
    }

    /// Creates the quantity of `number` units.
    ///
    /// # Errors
    /// Numbers that over- or underflow in SI units, and temperatures below absolute zero.
    pub fn quantity(&self, number: f64) -> Result<Quantity<D>, UnitError> {
        // −0 stays −0
        let from_zero = if self.zero == 0.0 { number } else { number + self.zero };
        let si = from_zero * self.numerator / self.denominator;
        let problem = if !si.is_finite() {
            "is too large for a 64-bit number in SI units"
        } else if number != 0.0 && si.abs() < f64::MIN_POSITIVE && !D::ABSOLUTE_TEMPERATURE {
            "is too small for a 64-bit number in SI units"
        } else if D::ABSOLUTE_TEMPERATURE && si < 0.0 {
            "lies below absolute zero"
        } else {
            return Ok(Quantity::from_si(si));
        };
        Err(UnitError::Range { text: format!("{number:?} {}", self.text).trim().to_owned(), problem })
    }
}

/// Returns true if a text is a unit of any dimension.
pub fn is_unit(text: &str) -> bool {
    !text.is_empty() && (table::affine(text).is_some() || grammar::unit(text, text).is_ok())
}

impl<D: Dimension> fmt::Display for Quantity<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:?}", self.si)?;
        if D::UNIT.is_empty() { Ok(()) } else { write!(f, " {}", D::UNIT) }
    }
}

impl<D: Dimension> Serialize for Quantity<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de, D: Dimension> Deserialize<'de> for Quantity<D> {
    fn deserialize<De: Deserializer<'de>>(deserializer: De) -> Result<Self, De::Error> {
        deserializer.deserialize_any(QuantityVisitor(PhantomData))
    }
}

/// Text `NUMBER UNIT`; also a bare number if the quantity has no unit.
#[cfg(feature = "schemars")]
impl<D: Dimension> schemars::JsonSchema for Quantity<D> {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        let noun = D::NAME.trim_start_matches("an ").trim_start_matches("a ");
        noun.replace(|letter: char| !letter.is_ascii_alphanumeric(), "_").into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        const NUMBER: &str = r"^\s*[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?";
        if D::EXPONENTS == [0; 8] {
            return schemars::json_schema!({
                "type": ["number", "string"],
                "description": D::NAME,
                "pattern": format!("{NUMBER}\\s*[%‰]?\\s*$"),
                "examples": [D::EXAMPLE],
            });
        }
        schemars::json_schema!({
            "type": "string",
            "description": format!("{} with its unit", D::NAME),
            "pattern": format!("{NUMBER}\\s*\\S.*$"),
            "examples": [D::EXAMPLE],
        })
    }
}

struct QuantityVisitor<D>(PhantomData<D>);

impl<D: Dimension> QuantityVisitor<D> {
    fn number<E: de::Error>(self, value: f64) -> Result<Quantity<D>, E> {
        if D::EXPONENTS != [0; 8] {
            return Err(E::custom(UnitError::bare::<D>(&value.to_string())));
        }
        if !value.is_finite() {
            let text = value.to_string();
            return Err(E::custom(UnitError::Range { text, problem: "is not a finite number" }));
        }
        Ok(Quantity::from_si(value))
    }
}

impl<D: Dimension> Visitor<'_> for QuantityVisitor<D> {
    type Value = Quantity<D>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} with its unit, e.g. \"{}\"", D::NAME, D::EXAMPLE)
    }

    fn visit_str<E: de::Error>(self, text: &str) -> Result<Self::Value, E> {
        text.parse().map_err(E::custom)
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Self::Value, E> {
        self.number(value)
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Self::Value, E> {
        self.number(value as f64)
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Self::Value, E> {
        self.number(value as f64)
    }
}

macro_rules! dimensions {
    ($($(#[$doc:meta])* $alias:ident, $marker:ident: $exponents:expr, $name:literal, $unit:literal,
        $example:literal
        $(, $absolute:literal)?;)+) => {
        /// The marker types behind the aliases, one for each kind of quantity.
        pub mod dimension {
            use super::{Dimension, Exponents};
            $(
                #[doc = concat!("Dimension of ", $name, ", in SI: `", $unit, "`.")]
                #[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
                pub enum $marker {}

                impl Dimension for $marker {
                    const EXPONENTS: Exponents = $exponents;
                    const NAME: &'static str = $name;
                    const EXAMPLE: &'static str = $example;
                    const UNIT: &'static str = $unit;
                    $(const ABSOLUTE_TEMPERATURE: bool = $absolute;)?
                }
            )+
        }

        $(
            $(#[$doc])*
            #[doc = concat!("\n\nSI unit: `", $unit, "`; for example `\"", $example, "\"`.")]
            pub type $alias = Quantity<dimension::$marker>;
        )+

        /// Exponents and names in the order of declaration; the first match names a quantity.
        const NAMES: &[(Exponents, &str)] = &[$(($exponents, $name)),+];
    };
}

/// Exponents of a `uom` quantity.
macro_rules! exponents {
    ($quantity:ident) => {{
        use uom::si::Dimension as D;
        use uom::typenum::Integer as I;
        type Q = uom::si::$quantity::Dimension;
        [
            <<Q as D>::L as I>::I8,
            <<Q as D>::M as I>::I8,
            <<Q as D>::T as I>::I8,
            <<Q as D>::I as I>::I8,
            <<Q as D>::Th as I>::I8,
            <<Q as D>::N as I>::I8,
            <<Q as D>::J as I>::I8,
            0,
        ]
    }};
}
pub(crate) use exponents;

dimensions! {
    /// A number without a dimension; `"1 %"`, `"0.01"` and the bare `0.01` are all accepted.
    Ratio, RatioDimension: exponents!(ratio), "a dimensionless number", "", "0.01";
    /// A length.
    Length, LengthDimension: exponents!(length), "a length", "m", "2 mm";
    /// An area.
    Area, AreaDimension: exponents!(area), "an area", "m^2", "5 mm^2";
    /// A volume.
    Volume, VolumeDimension: exponents!(volume), "a volume", "m^3", "1 mm^3";
    /// A time or duration.
    Time, TimeDimension: exponents!(time), "a time", "s", "30 s";
    /// A mass.
    Mass, MassDimension: exponents!(mass), "a mass", "kg", "2 kg";
    /// A force.
    Force, ForceDimension: exponents!(force), "a force", "N", "10 N";
    /// A stress, pressure or elastic modulus.
    Stress, StressDimension: exponents!(pressure), "a stress", "Pa", "0.6 N/mm^2";
    /// A dynamic viscosity.
    Viscosity, ViscosityDimension: exponents!(dynamic_viscosity), "a viscosity", "Pa s", "3 MPa s";
    /// Reciprocal of a squared stress.
    PerSquaredStress, PerSquaredStressDimension: [2, -2, 4, 0, 0, 0, 0, 0], "a number per squared \
        stress", "1/Pa^2", "1 1/kPa^2";
    /// A mass density.
    Density, DensityDimension: exponents!(mass_density), "a mass density", "kg/m^3", "1010 kg/m^3";
    /// A speed.
    Speed, SpeedDimension: exponents!(velocity), "a speed", "m/s", "5 mm/s";
    /// An acceleration.
    Acceleration, AccelerationDimension: exponents!(acceleration), "an acceleration", "m/s^2", "9.81 m/s^2";
    /// An angular velocity.
    AngularVelocity, AngularVelocityDimension: [0, 0, -1, 0, 0, 0, 0, 1], "an angular velocity", "rad/s",
        "100 rad/s";
    /// A rate or frequency.
    Rate, RateDimension: exponents!(frequency), "a rate", "1/s", "5e-5 /s";
    /// An absolute temperature; the only quantity that may be given in `degC`.
    Temperature, TemperatureDimension: exponents!(thermodynamic_temperature),
        "a temperature", "K", "220 degC", true;
    /// A difference of temperatures, in kelvin.
    TemperatureDifference, TemperatureDifferenceDimension: exponents!(temperature_interval), "a temperature \
        difference", "K", "5 K";
    /// A heating or cooling rate.
    TemperatureRate, TemperatureRateDimension: [0, 0, -1, 0, 1, 0, 0, 0], "a temperature \
        rate", "K/s", "10 K/min";
    /// A square of temperatures, as nucleation constants are.
    SquaredTemperature, SquaredTemperatureDimension: [0, 0, 0, 0, 2, 0, 0, 0],
        "a squared temperature", "K^2", "136235 K^2";
    /// A change per temperature.
    PerTemperature, PerTemperatureDimension: [0, 0, 0, 0, -1, 0, 0, 0], "a number per \
        temperature", "1/K", "0.965 1/K";
    /// An energy per amount of substance.
    MolarEnergy, MolarEnergyDimension: exponents!(molar_energy), "a molar energy", "J/mol", "6270 J/mol";
    /// A mass per amount of substance.
    MolarMass, MolarMassDimension: exponents!(molar_mass), "a molar mass", "kg/mol", "10 kg/mol";
    /// An energy (a torque has the same dimension).
    Energy, EnergyDimension: exponents!(energy), "an energy", "J", "1 J";
    /// A torque.
    Torque, TorqueDimension: exponents!(energy), "a torque", "N m", "30 N mm";
    /// A power.
    Power, PowerDimension: exponents!(power), "a power", "W", "21 W";
    /// A power per mass, as calorimeters measure it.
    SpecificPower, SpecificPowerDimension: [2, 0, -3, 0, 0, 0, 0, 0], "a power per mass", "W/kg", "1.5 W/g";
    /// An energy per area or force per length: fracture energy, surface tension; `N/mm` = 1000 J/m².
    EnergyPerArea, EnergyPerAreaDimension: exponents!(surface_tension), "an energy per \
        area", "J/m^2", "2.67 N/mm";
    /// A specific energy or latent heat.
    SpecificEnergy, SpecificEnergyDimension: exponents!(available_energy), "an energy per \
        mass", "J/kg", "104.5 J/g";
    /// A specific heat capacity.
    SpecificHeat, SpecificHeatDimension: exponents!(specific_heat_capacity), "a specific heat \
        capacity", "J/(kg K)", "2200 J/(kg K)";
    /// A thermal conductivity.
    Conductivity, ConductivityDimension: exponents!(thermal_conductivity),
        "a thermal conductivity", "W/(m K)", "0.25 W/(m K)";
    /// A film coefficient of heat transfer.
    HeatTransfer, HeatTransferDimension: exponents!(heat_transfer), "a heat transfer \
        coefficient", "W/(m^2 K)", "50 W/(m^2 K)";
    /// A heat flux.
    HeatFlux, HeatFluxDimension: exponents!(heat_flux_density), "a heat flux", "W/m^2", "500 W/m^2";
    /// Heat released per volume and time.
    PowerDensity, PowerDensityDimension: [-1, 1, -3, 0, 0, 0, 0, 0], "a power per \
        volume", "W/m^3", "1 W/mm^3";
    /// A thermal diffusivity or kinematic viscosity.
    Diffusivity, DiffusivityDimension: exponents!(diffusion_coefficient),
        "a diffusivity", "m^2/s", "0.11 mm^2/s";
    /// A plane angle; needs its unit.
    Angle, AngleDimension: [0, 0, 0, 0, 0, 0, 0, 1], "an angle", "rad", "90 deg";
    /// An angle per length.
    Twist, TwistDimension: [-1, 0, 0, 0, 0, 0, 0, 1], "an angle per length", "rad/m", "2 deg/mm";
}

/// `a stress`, or the coherent SI unit where the dimension has no name.
fn name_of(exponents: Exponents) -> String {
    if let Some((_, name)) = NAMES.iter().find(|(e, _)| *e == exponents) {
        return (*name).to_owned();
    }
    let symbols = ["m", "kg", "s", "A", "K", "mol", "cd", "rad"];
    let mut order: Vec<usize> = (0..8).filter(|&i| exponents[i] != 0).collect();
    order.sort_by_key(|&i| exponents[i] < 0);
    let factors = order.iter().map(|&i| match exponents[i] {
        1 => symbols[i].to_owned(),
        power => format!("{}^{power}", symbols[i]),
    });
    format!("a quantity in {}", factors.collect::<Vec<_>>().join(" "))
}

#[cfg(test)]
mod tests;
