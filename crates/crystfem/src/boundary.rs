//! Boundary conditions and heat sources: prescribed temperature, flux, film, radiation. Temperatures in K.

use crate::error::Error;
use crate::mesh::Face;
use std::sync::Arc;

/// Stefan–Boltzmann constant, W/(m² K⁴) (CODATA 2018).
pub const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;

/// A value over time: piecewise linear and constant outside its times, or a sine.
#[derive(Clone, Debug, PartialEq)]
pub struct Schedule {
    times: Vec<f64>,
    /// Values at the times; for a sine its lowest and highest value.
    values: Vec<f64>,
    /// Period of a sine, s; `None` if piecewise linear.
    period: Option<f64>,
}

impl Schedule {
    /// Returns a constant.
    pub fn constant(value: f64) -> Self {
        Self { times: vec![0.0], values: vec![value], period: None }
    }

    /// Returns a sine between two values with its mean, rising, at t = 0.
    ///
    /// # Errors
    /// [`Error::Parameter`] for values that are not finite, `high` below `low`, and a period that is not
    /// above 0 and finite.
    pub fn swing(low: f64, high: f64, period: f64) -> Result<Self, Error> {
        let wrong = |name, found, allowed: String| Err(Error::Parameter { name, found, allowed });
        if !low.is_finite() {
            return wrong("low value", low, "a finite number".into());
        }
        if !(high >= low && high.is_finite()) {
            return wrong("high value", high, format!("{low} (the low one) or above, finite"));
        }
        if !(period > 0.0 && period.is_finite()) {
            return wrong("period, s", period, "above 0, finite".into());
        }
        Ok(Self { times: Vec::new(), values: vec![low, high], period: Some(period) })
    }

    /// Period of a sine, s.
    pub fn period(&self) -> Option<f64> {
        self.period
    }

    /// Interpolates (time, value) pairs. Time steps end at their times.
    ///
    /// # Errors
    /// [`Error::Parameter`] for no pairs, times that do not ascend, and values that are not finite.
    pub fn linear(pairs: &[(f64, f64)]) -> Result<Self, Error> {
        let wrong = |name, found, allowed: &str| Error::Parameter { name, found, allowed: allowed.into() };
        if pairs.is_empty() {
            return Err(wrong("number of times", 0.0, "at least one pair of time and value"));
        }
        for (index, &(time, value)) in pairs.iter().enumerate() {
            if !time.is_finite() {
                return Err(wrong("time, s", time, "a finite number"));
            }
            if !value.is_finite() {
                return Err(wrong("value", value, "a finite number"));
            }
            if index > 0 && time <= pairs[index - 1].0 {
                return Err(wrong("time, s", time, "a time after the previous one"));
            }
        }
        Ok(Self {
            times: pairs.iter().map(|pair| pair.0).collect(),
            values: pairs.iter().map(|pair| pair.1).collect(),
            period: None,
        })
    }

    /// Lowest value.
    pub fn lowest(&self) -> f64 {
        self.values.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// Highest value.
    pub fn highest(&self) -> f64 {
        self.values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the value at a time, s.
    pub fn value_at(&self, time: f64) -> f64 {
        if let (Some(period), [low, high]) = (self.period, &self.values[..]) {
            // remove whole periods first: the sine of a large argument loses digits
            let turn = (time / period).fract() * std::f64::consts::TAU;
            return 0.5 * (low + high) + 0.5 * (high - low) * turn.sin();
        }
        let next = self.times.partition_point(|&t| t <= time);
        if next == 0 {
            return self.values[0];
        }
        if next == self.times.len() {
            return self.values[next - 1];
        }
        let part = (time - self.times[next - 1]) / (self.times[next] - self.times[next - 1]);
        self.values[next - 1] + part * (self.values[next] - self.values[next - 1])
    }

    /// Times at which the slope changes; empty for a constant.
    pub fn breaks(&self) -> &[f64] {
        if self.times.len() > 1 { &self.times } else { &[] }
    }

    fn finite(&self) -> bool {
        self.values.iter().all(|v| v.is_finite())
    }
}

/// A function of position (m) and time (s).
pub type FieldFunction = Arc<dyn Fn([f64; 3], f64) -> f64 + Send + Sync>;

/// A value over space and time.
#[derive(Clone)]
pub enum Field {
    /// Uniform in space.
    Uniform(Schedule),
    /// A function of position and time; it should be smooth in time.
    Function(FieldFunction),
}

impl Field {
    /// Returns a value constant in space and time.
    pub fn constant(value: f64) -> Self {
        Self::Uniform(Schedule::constant(value))
    }

    /// Wraps a function of position, m, and time, s.
    pub fn function(function: impl Fn([f64; 3], f64) -> f64 + Send + Sync + 'static) -> Self {
        Self::Function(Arc::new(function))
    }

    /// Returns the value at a position, m, and time, s.
    pub fn value_at(&self, place: [f64; 3], time: f64) -> f64 {
        match self {
            Self::Uniform(schedule) => schedule.value_at(time),
            Self::Function(function) => function(place, time),
        }
    }

    /// Times at which the slope changes.
    pub fn breaks(&self) -> &[f64] {
        match self {
            Self::Uniform(schedule) => schedule.breaks(),
            Self::Function(_) => &[],
        }
    }

    /// Period of a sine, s.
    pub fn period(&self) -> Option<f64> {
        match self {
            Self::Uniform(schedule) => schedule.period(),
            Self::Function(_) => None,
        }
    }

    fn check(&self, name: &'static str) -> Result<(), Error> {
        match self {
            Self::Uniform(schedule) if !schedule.finite() => {
                let found = schedule.values.iter().copied().find(|v| !v.is_finite()).unwrap_or(f64::NAN);
                Err(Error::Parameter { name, found, allowed: "a finite number".into() })
            }
            _ => Ok(()),
        }
    }
}

impl std::fmt::Debug for Field {
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Uniform(schedule) => schedule.fmt(out),
            Self::Function(_) => out.write_str("a function of position and time"),
        }
    }
}

/// Faces on which a condition acts. A face counts only while it is on the current outer surface: exactly one
/// of its elements exists.
#[derive(Clone, Debug, PartialEq)]
pub enum FaceSelection {
    /// Listed faces, in either orientation.
    Faces(Vec<Face>),
    /// Current outer surface, except some faces.
    Outer {
        /// Excluded faces.
        except: Vec<Face>,
    },
}

impl FaceSelection {
    /// Returns the whole current outer surface.
    pub fn outer() -> Self {
        Self::Outer { except: Vec::new() }
    }
}

/// A boundary condition. Heat of several conditions on one face adds up.
#[derive(Clone, Debug)]
pub enum Condition {
    /// Prescribed temperature, K, of nodes. The last condition on a node wins.
    Temperature {
        /// Nodes of the mesh.
        nodes: Vec<u32>,
        /// Temperature, K.
        value: Field,
    },
    /// Heat flux into the body, W/m².
    Flux {
        /// Faces.
        surface: FaceSelection,
        /// Heat into the body, W/m².
        inward: Field,
    },
    /// Heat loss h (T − T_a), W/m².
    Film {
        /// Faces.
        surface: FaceSelection,
        /// h, W/(m² K).
        coefficient: Schedule,
        /// T_a, K.
        ambient: Schedule,
    },
    /// Heat loss ε σ (T⁴ − T_a⁴), W/m².
    Radiation {
        /// Faces.
        surface: FaceSelection,
        /// ε, 0 to 1.
        emissivity: f64,
        /// T_a, K.
        ambient: Schedule,
    },
}

impl Condition {
    /// Faces of the condition; `None` for prescribed temperatures.
    pub fn surface(&self) -> Option<&FaceSelection> {
        match self {
            Self::Temperature { .. } => None,
            Self::Flux { surface, .. } | Self::Film { surface, .. } | Self::Radiation { surface, .. } => {
                Some(surface)
            }
        }
    }

    /// Times at which the slope of a schedule changes.
    pub fn breaks(&self) -> Vec<f64> {
        match self {
            Self::Temperature { value, .. } => value.breaks().to_vec(),
            Self::Flux { inward, .. } => inward.breaks().to_vec(),
            Self::Film { coefficient, ambient, .. } => [coefficient.breaks(), ambient.breaks()].concat(),
            Self::Radiation { ambient, .. } => ambient.breaks().to_vec(),
        }
    }

    /// Shortest period of its sines, s.
    pub fn period(&self) -> Option<f64> {
        let periods = match self {
            Self::Temperature { value, .. } => [value.period(), None],
            Self::Flux { inward, .. } => [inward.period(), None],
            Self::Film { coefficient, ambient, .. } => [coefficient.period(), ambient.period()],
            Self::Radiation { ambient, .. } => [ambient.period(), None],
        };
        periods.into_iter().flatten().min_by(f64::total_cmp)
    }

    /// Checks the values.
    ///
    /// # Errors
    /// [`Error::Parameter`] for values out of their domain.
    pub(crate) fn check(&self) -> Result<(), Error> {
        let wrong =
            |name, found, allowed: &str| Err(Error::Parameter { name, found, allowed: allowed.into() });
        let not_below_zero =
            |name, ambient: &Schedule| match ambient.values.iter().find(|v| v.is_nan() || **v < 0.0) {
                Some(&found) => wrong(name, found, "an absolute temperature, 0 K or above"),
                None => Ok(()),
            };
        match self {
            Self::Temperature { value, .. } => match value {
                Field::Uniform(schedule) => not_below_zero("prescribed temperature", schedule),
                Field::Function(_) => Ok(()),
            },
            Self::Flux { inward, .. } => inward.check("flux"),
            Self::Film { coefficient, ambient, .. } => {
                // at a higher h, k/h is below the size of an atom: the surface is held, not cooled
                let bad = |h: &&f64| !(0.0..=1e12).contains(*h);
                if let Some(&found) = coefficient.values.iter().find(bad) {
                    let allowed = "0 to 1e12 W/(m² K); beyond it, prescribe its `temperature`";
                    return wrong("film coefficient", found, allowed);
                }
                not_below_zero("ambient temperature", ambient)
            }
            Self::Radiation { emissivity, ambient, .. } => {
                if !(0.0..=1.0).contains(emissivity) {
                    return wrong("emissivity", *emissivity, "0 to 1");
                }
                not_below_zero("ambient temperature", ambient)
            }
        }
    }
}

/// A heat source in a volume.
#[derive(Clone, Debug)]
pub struct HeatSource {
    /// Elements.
    pub elements: Vec<u32>,
    /// Heat per volume, W/m³.
    pub power: Field,
}

impl HeatSource {
    /// Checks the power.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a power that is not finite.
    pub(crate) fn check(&self) -> Result<(), Error> {
        self.power.check("heat source")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn schedules() {
        let ramp = Schedule::linear(&[(0.0, 300.0), (10.0, 400.0), (20.0, 350.0)]).unwrap();
        for (time, value) in
            [(-1.0, 300.0), (0.0, 300.0), (5.0, 350.0), (10.0, 400.0), (15.0, 375.0), (99.0, 350.0)]
        {
            assert_eq!(ramp.value_at(time), value);
        }
        assert_eq!(ramp.breaks(), [0.0, 10.0, 20.0]);
        assert!(Schedule::constant(3.0).breaks().is_empty());
        for wrong in [&[][..], &[(0.0, f64::NAN)], &[(1.0, 2.0), (1.0, 3.0)], &[(f64::INFINITY, 1.0)]] {
            assert!(Schedule::linear(wrong).is_err());
        }
    }

    #[test]
    fn swings() {
        let swing = Schedule::swing(200.0, 400.0, 80.0).unwrap();
        for (time, value) in [
            (0.0, 300.0),
            (20.0, 400.0),
            (32.0, 300.0 + 100.0 * (0.8 * std::f64::consts::PI).sin()),
            (60.0, 200.0),
            (8e15, 300.0),
        ] {
            assert!((swing.value_at(time) - value).abs() < 1e-12, "{time}: {}", swing.value_at(time));
        }
        assert!(swing.breaks().is_empty() && swing.period() == Some(80.0));
        for (low, high, period) in
            [(f64::NAN, 1.0, 1.0), (2.0, 1.0, 1.0), (1.0, f64::INFINITY, 1.0), (1.0, 2.0, 0.0)]
        {
            assert!(Schedule::swing(low, high, period).is_err());
        }
        // the error names the end that is out of range
        let cold = Condition::Temperature {
            nodes: vec![0],
            value: Field::Uniform(Schedule::swing(-1.0, 9.0, 1.0).unwrap()),
        };
        assert!(cold.check().unwrap_err().to_string().contains("found -1"));
    }

    #[test]
    fn invalid_values_are_refused() {
        let surface = || FaceSelection::Outer { except: Vec::new() };
        let film = |coefficient, ambient| Condition::Film {
            surface: surface(),
            coefficient: Schedule::constant(coefficient),
            ambient: Schedule::constant(ambient),
        };
        assert!(film(0.0, 0.0).check().is_ok());
        assert!(film(-1.0, 300.0).check().unwrap_err().to_string().contains("found -1"));
        assert!(film(1.0, -3.0).check().is_err() && film(1.0, f64::NAN).check().is_err());
        let radiation =
            Condition::Radiation { surface: surface(), emissivity: 1.1, ambient: Schedule::constant(0.0) };
        assert!(radiation.check().unwrap_err().to_string().contains("0 to 1"));
        let flux = Condition::Flux { surface: surface(), inward: Field::constant(f64::NAN) };
        assert!(flux.check().is_err());
        assert!(HeatSource { elements: vec![0], power: Field::constant(f64::INFINITY) }.check().is_err());
    }
}
