//! Measured histories of a material point.

use super::super::{History, Pace, Reaction, Viscoelastic, nominal_of_test, strain_of_test};
use crate::constitutive::Error;
use crate::constitutive::hyperelastic::data::{Mode, TestData, TestState};
use crate::constitutive::hyperelastic::fit::Agreement;
use crate::tensor::Voigt;

/// Test of an incompressible body whose strain follows a program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Test {
    /// Bar in tension or compression; its strain is the stretch, 1 at rest.
    Uniaxial,
    /// Simple shear; its strain is the amount of shear, 0 at rest.
    SimpleShear,
}

/// Time, strain and stress of a point of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Time since the body was at rest, s.
    pub time: f64,
    /// Stretch or amount of shear.
    pub strain: f64,
    /// Nominal stress, Pa.
    pub nominal: f64,
}

/// Measured run: a body at rest at 0 s whose strain is linear between its points.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredRun {
    /// Name in tables and messages.
    pub name: String,
    /// Rate of strain, 1/s: runs of one rate are left out together.
    pub rate: f64,
    /// The test.
    pub test: Test,
    /// The points, in the order of time.
    points: Vec<Measurement>,
}

/// Largest strain at 0 s, from rest.
const AT_REST: f64 = 1e-3;

impl MeasuredRun {
    /// Creates a run.
    ///
    /// # Errors
    /// [`Error::Data`] for fewer than two points, numbers that are not finite, stretches that are not above
    /// 0, times below 0 or decreasing, and a strain at 0 s: the ramp belongs to the run.
    pub fn new(name: &str, rate: f64, test: Test, points: Vec<Measurement>) -> Result<Self, Error> {
        let refuse = |reason: String| Err(Error::Data { what: format!("run `{name}`"), reason });
        if points.len() < 2 {
            return refuse(format!("{} points; a run has two or more", points.len()));
        }
        if !(rate.is_finite() && rate > 0.0) {
            return refuse(format!("the rate is {rate} /s, but must be above 0"));
        }
        let mut before = 0.0;
        for Measurement { time, strain, nominal } in &points {
            if ![*time, *strain, *nominal].iter().all(|x| x.is_finite()) {
                return refuse(format!("time {time}, strain {strain}, stress {nominal}: not all are finite"));
            }
            if test == Test::Uniaxial && *strain <= 0.0 {
                return refuse(format!("the stretch is {strain}, but must be above 0"));
            }
            if *time < before {
                return refuse(format!("{time} s follows {before} s"));
            }
            if *time == 0.0 && (strain - test.rest()).abs() > AT_REST {
                let rest = test.rest();
                return refuse(format!("the strain is {strain} at 0 s, not {rest}: begin with the ramp"));
            }
            before = *time;
        }
        Ok(Self { name: name.to_owned(), rate, test, points })
    }

    /// Creates a cycle at a constant rate of strain from strains and stresses: time is the path of the strain
    /// over the rate, from rest to the turn, the strain farthest from rest, and back. Points that were
    /// digitised out of order are put in the order of time.
    ///
    /// # Errors
    /// As [`MeasuredRun::new`].
    pub fn cycle(name: &str, rate: f64, test: Test, points: &[[f64; 2]]) -> Result<Self, Error> {
        let away = |point: &[f64; 2]| (point[0] - test.rest()).abs();
        let turn = (0..points.len()).max_by(|a, b| away(&points[*a]).total_cmp(&away(&points[*b])));
        let top = turn.unwrap_or(0);
        let most = points.get(top).map_or(0.0, away);
        let timed = points.iter().enumerate().map(|(k, point)| {
            let path = if k <= top { away(point) } else { 2.0 * most - away(point) };
            Measurement { time: path / rate, strain: point[0], nominal: point[1] }
        });
        let mut points: Vec<Measurement> = timed.collect();
        points.sort_by(|a, b| a.time.total_cmp(&b.time));
        Self::new(name, rate, test, points)
    }

    /// The points, in the order of time.
    pub fn points(&self) -> &[Measurement] {
        &self.points
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.points.last().map_or(0.0, |point| point.time)
    }

    /// Computes the nominal stress of a law at each point, Pa; `pace` holds for the intervals between the
    /// points.
    ///
    /// # Errors
    /// As [`Viscoelastic::follow`].
    pub fn stresses(&self, law: &Viscoelastic, pace: Pace) -> Result<Vec<f64>, Error> {
        let mut path = vec![[0.0, self.test.rest()]];
        // points of one time, after the first, share its state
        let mut states = Vec::with_capacity(self.points.len());
        for point in &self.points {
            if point.time > path[path.len() - 1][0] {
                path.push([point.time, point.strain]);
            }
            states.push(path.len() - 1);
        }
        let found = self.test.follow(law, &path, pace)?;
        Ok(states.into_iter().map(|state| found[state]).collect())
    }

    /// Compares a law with the measured stresses.
    ///
    /// # Errors
    /// As [`MeasuredRun::stresses`].
    pub fn agreement(&self, law: &Viscoelastic, pace: Pace) -> Result<Agreement, Error> {
        let measured = self.points.iter().map(|point| point.nominal);
        Ok(Agreement::of_residuals(&self.residuals(law, pace)?, measured))
    }

    /// Model minus data at each point, Pa.
    pub(super) fn residuals(&self, law: &Viscoelastic, pace: Pace) -> Result<Vec<f64>, Error> {
        let found = self.stresses(law, pace)?;
        Ok(found.iter().zip(&self.points).map(|(model, point)| model - point.nominal).collect())
    }
}

impl Test {
    /// Strain at rest.
    pub fn rest(self) -> f64 {
        match self {
            Self::Uniaxial => 1.0,
            Self::SimpleShear => 0.0,
        }
    }

    /// I₁ − 3 at a strain.
    fn excess(self, strain: f64) -> f64 {
        match self {
            Self::Uniaxial => strain * strain + 2.0 / strain - 3.0,
            Self::SimpleShear => strain * strain,
        }
    }

    /// C at a strain.
    pub fn deformation(self, strain: f64) -> Voigt {
        match self {
            Self::Uniaxial => strain_of_test(Mode::Uniaxial, strain),
            Self::SimpleShear => Voigt::new(1.0, 1.0 + strain * strain, 1.0, strain, 0.0, 0.0),
        }
    }

    /// Nominal stress, Pa, from the part of S that the law determines. The pressure does not enter P₁₂ = S₁₂
    /// + γ S₂₂.
    pub fn nominal(self, strain: f64, stress: &Voigt) -> f64 {
        match self {
            Self::Uniaxial => nominal_of_test(&self.deformation(strain), stress),
            Self::SimpleShear => stress[3] + strain * stress[1],
        }
    }

    /// Computes the nominal stress, Pa, at each [time, strain] of a path that begins at rest and is linear
    /// between them.
    ///
    /// # Errors
    /// As [`Viscoelastic::follow`].
    pub fn follow(self, law: &Viscoelastic, path: &[[f64; 2]], pace: Pace) -> Result<Vec<f64>, Error> {
        let times: Vec<f64> = path.iter().map(|point| point[0]).collect();
        let strain = |time: f64| {
            let after = times.partition_point(|t| *t < time).clamp(1, times.len() - 1);
            let [[t0, e0], [t1, e1]] = [path[after - 1], path[after]];
            self.deformation(e0 + (e1 - e0) * (time - t0) / (t1 - t0))
        };
        if path.len() < 2 {
            return Ok(vec![0.0; path.len()]);
        }
        let reaction = match self {
            Self::Uniaxial => Reaction::Test(Mode::Uniaxial),
            Self::SimpleShear => Reaction::Test(Mode::PureShear),
        };
        let history = History { strain: &strain, temperature: &|_| 293.15, times: &times, reaction };
        let trace = law.follow(&history, law.rest(), pace)?;
        let after = trace.points.iter().zip(&path[1..]);
        let stresses = after.map(|(found, point)| self.nominal(point[1], &found.step.prediction.stress));
        Ok([0.0].into_iter().chain(stresses).collect())
    }

    /// Elastic state with the same stress of a law in I₁ and I₂: simple shear γ is pure shear of the stretch
    /// λ − 1/λ = γ, whose P₁ is P₁₂(1 + λ⁻²).
    fn elastic_state(self, point: &Measurement) -> TestState {
        match self {
            Self::Uniaxial => {
                let second = Mode::Uniaxial.second_stretch(point.strain);
                let stretches = [point.strain, second];
                TestState::new(Mode::Uniaxial, stretches, [point.nominal, 0.0])
            }
            Self::SimpleShear => {
                let half = 0.5 * point.strain;
                let stretch = half + half.hypot(1.0);
                let nominal = point.nominal * (1.0 + stretch.powi(-2));
                TestState::new(Mode::PureShear, [stretch, 1.0], [nominal, 0.0])
            }
        }
    }
}

/// Ratio of I₁ − 3 at two turns that are different.
const DIFFERENT: f64 = 1.1;

/// Change of I₁ − 3 over its largest value below which a turn is noise of the strain.
const NOISE: f64 = 0.05;

/// Number of different strains at which runs turn after more than before, and the largest I₁ − 3.
pub(super) fn turns(runs: &[MeasuredRun]) -> (usize, f64) {
    let excess = |run: &MeasuredRun| -> Vec<f64> {
        run.points.iter().map(|point| run.test.excess(point.strain)).collect()
    };
    let most = runs.iter().flat_map(excess).fold(0.0, f64::max);
    let mut turns = Vec::new();
    for run in runs {
        let (mut record, mut counted) = (0.0, true);
        for now in excess(run) {
            if now > record {
                (record, counted) = (now, now <= NOISE * most);
            } else if !counted && record - now > NOISE * most {
                turns.push(record);
                counted = true;
            }
        }
    }
    turns.sort_by(f64::total_cmp);
    let (mut count, mut last) = (0, 0.0);
    for turn in turns {
        if turn > DIFFERENT * last {
            (count, last) = (count + 1, turn);
        }
    }
    (count, most)
}

/// All points as elastic states, of which a law without time takes the mean.
pub(super) fn elastic(runs: &[MeasuredRun]) -> TestData {
    let states = runs.iter().flat_map(|run| run.points.iter().map(|point| run.test.elastic_state(point)));
    TestData::new(String::new(), states.collect())
}
