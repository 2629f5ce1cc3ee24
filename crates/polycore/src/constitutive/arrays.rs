//! Laws and fits on arrays (feature `ndarray`): array views as input, arrays as output.

use super::hyperelastic::data::{Mode, TestData, TestState};
use super::law::same_length;
use super::{Error, Flags, Law, Prediction, Workspace};
use crate::tensor::Voigt;
use ndarray::{Array1, Array2, Array3, ArrayView1, ArrayView2};

/// Predictions of a law at N points.
#[derive(Debug, Clone, PartialEq)]
pub struct Predictions {
    /// S, (N, 6), Pa.
    pub stress: Array2<f64>,
    /// ℂ = 2 ∂S/∂C, (N, 6, 6), Pa; if requested.
    pub tangent: Option<Array3<f64>>,
    /// W, (N), J/m³; `None` for a law without an energy.
    pub energy: Option<Array1<f64>>,
    /// Spread of an ensemble, (N), Pa; 0 for other laws.
    pub spread: Array1<f64>,
    /// Standard deviation of each component of S over an ensemble, (N, 6), Pa; 0 for other laws.
    pub deviation: Array2<f64>,
    /// Reasons for uncertainty, (N).
    pub flags: Array1<Flags>,
}

/// Computes S, and ℂ if `tangent`, at each row of C, (N, 6), in the order 11, 22, 33, 12, 13, 23.
///
/// # Errors
/// [`Error::Invalid`] for another number of columns; errors of the law.
pub fn predict(law: &dyn Law, c: ArrayView2<'_, f64>, tangent: bool) -> Result<Predictions, Error> {
    let points = rows(c, "C")?;
    let mut all = vec![Prediction::default(); points.len()];
    let mut memory = Workspace::default();
    if tangent {
        for (c, prediction) in points.iter().zip(&mut all) {
            *prediction = law.tangent(c, &mut memory)?;
        }
    } else {
        law.stresses(&points, &mut memory, &mut all)?;
    }
    let count = all.len();
    let with_tangent = all.iter().all(|found| found.tangent.is_some()) && tangent;
    Ok(Predictions {
        stress: Array2::from_shape_fn((count, 6), |(k, a)| all[k].stress[a]),
        tangent: with_tangent.then(|| {
            let component = |(k, a, b): (usize, usize, usize)| all[k].tangent.map_or(0.0, |t| t[(a, b)]);
            Array3::from_shape_fn((count, 6, 6), component)
        }),
        energy: all.iter().map(|found| found.energy).collect(),
        spread: all.iter().map(|found| found.spread).collect(),
        deviation: Array2::from_shape_fn((count, 6), |(k, a)| all[k].deviation[a]),
        flags: all.iter().map(|found| found.flags).collect(),
    })
}

/// Converts an array (N, 6) to Voigt vectors; `name` appears in messages.
///
/// # Errors
/// [`Error::Invalid`] for another number of columns.
pub fn rows(array: ArrayView2<'_, f64>, name: &'static str) -> Result<Vec<Voigt>, Error> {
    if array.ncols() != 6 {
        return Err(Error::invalid(name, format!("{} columns", array.ncols()), "6: 11, 22, 33, 12, 13, 23"));
    }
    Ok(array.rows().into_iter().map(|row| Voigt::from_fn(|a, _| row[a])).collect())
}

impl TestData {
    /// Creates test data from stretches, (N), and nominal stresses, (N) in Pa, of a test that one stretch
    /// describes; a stress of exactly 0 is a condition, not a measurement.
    ///
    /// # Errors
    /// [`Error::Invalid`] for arrays of two lengths; [`Error::Deformation`] for a stretch that is not
    /// positive; [`Error::Data`] if no stress was measured.
    pub fn from_arrays(
        mode: Mode,
        stretch: ArrayView1<'_, f64>,
        nominal: ArrayView1<'_, f64>,
    ) -> Result<Self, Error> {
        same_length(stretch.len(), nominal.len())?;
        let state = |(&stretch, &nominal): (&f64, &f64)| {
            let stretches = [stretch, mode.second_stretch(stretch)];
            let state = TestState::new(mode, stretches, [nominal, 0.0]);
            state.principal_stretches().map(|_| state)
        };
        let states = stretch.iter().zip(nominal).map(state).collect::<Result<_, Error>>()?;
        Self::new(String::new(), states).select(mode)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::hyperelastic::{NeoHookean, fit, homogeneous, model};
    use ndarray::{Array, array, s};

    #[test]
    fn arrays_have_the_bits_of_single_points() {
        let law = NeoHookean::new(1e6).unwrap();
        // every second row of a larger array
        let c = array![
            [1.1, 1.0, 0.9, 0.1, 0.0, 0.05],
            [f64::NAN, 0.0, 0.0, 0.0, 0.0, 0.0],
            [1.0, 1.2, 1.0, 0.0, -0.2, 0.0],
        ];
        let every_second = c.slice(s![..;2, ..]);
        let found = predict(&law, every_second, true).unwrap();
        assert_eq!(found.stress.dim(), (2, 6));
        let mut memory = Workspace::default();
        for (k, row) in rows(every_second, "C").unwrap().iter().enumerate() {
            let alone = Law::tangent(&law, row, &mut memory).unwrap();
            assert_eq!(Voigt::from_fn(|a, _| found.stress[[k, a]]), alone.stress);
            assert_eq!(found.energy.as_ref().unwrap()[k], alone.energy.unwrap());
            assert_eq!(found.tangent.as_ref().unwrap()[[k, 3, 4]], alone.tangent.unwrap()[(3, 4)]);
        }
        assert!(predict(&law, every_second, false).unwrap().tangent.is_none());
        assert!(predict(&law, c.view(), true).is_err());
        let error = predict(&law, c.slice(s![.., ..3]), false).unwrap_err().to_string();
        assert!(error.contains("C: found 3 columns; allowed: 6"), "{error}");
    }

    #[test]
    fn a_fit_to_arrays() {
        let law = NeoHookean::new(3e5).unwrap();
        let stretch = Array::linspace(1.0, 3.0, 9);
        for (mode, of) in [
            (
                Mode::Uniaxial,
                homogeneous::uniaxial::<NeoHookean> as fn(&NeoHookean, f64) -> Result<f64, Error>,
            ),
            (Mode::Equibiaxial, homogeneous::equibiaxial),
        ] {
            let nominal = stretch.mapv(|stretch| of(&law, stretch).unwrap());
            let table = TestData::from_arrays(mode, stretch.view(), nominal.view()).unwrap();
            let fitted = fit::fit(model("neo-hookean").unwrap(), &table).unwrap();
            assert!((fitted.parameters[0].value / 3e5 - 1.0).abs() < 1e-9);
            assert!(TestData::from_arrays(mode, stretch.view(), nominal.slice(s![1..])).is_err());
            assert!(TestData::from_arrays(mode, (-&stretch).view(), nominal.view()).is_err());
            assert!(TestData::from_arrays(mode, stretch.slice(s![..1]), nominal.slice(s![..1])).is_err());
        }
    }
}
