//! State-based solids in a model.

use super::{Body, IntoMaterial, Simulation};
use crate::bonds::LatticeBonds;
use crate::calibrate::Space;
use crate::error::Error;
use crate::material::{Correspondence, EightChainSolid, NonlocalSolid, PointLaw};
use crate::probe::StressEvaluator;
use crate::stress::StressTensor;
use polycore::constitutive::Law;
use std::sync::Arc;

/// Material of a law and the critical stretch of a model: none.
type SolidMaterial<L> = (NonlocalSolid<L>, Option<f64>);

/// Wraps a law whose space must be that of the body.
fn wrap<const D: usize, L>(law: L, space: Space, body: &Body<D>) -> Result<SolidMaterial<L>, Error> {
    if space != body.space {
        let own = body.space;
        return Err(Error::geometry(format!("law: found {space:?}; allowed: {own:?}, that of the body")));
    }
    Ok((NonlocalSolid::new(law), None))
}

impl<const D: usize, L: Law + Clone + 'static> IntoMaterial<D> for Correspondence<L, D> {
    type Material = NonlocalSolid<Self>;

    fn into_material(self, body: &Body<D>, _: &LatticeBonds<D>) -> Result<SolidMaterial<Self>, Error> {
        let space = self.space;
        wrap(self, space, body)
    }
}

impl<const D: usize> IntoMaterial<D> for EightChainSolid<D> {
    type Material = NonlocalSolid<Self>;

    fn into_material(self, body: &Body<D>, _: &LatticeBonds<D>) -> Result<SolidMaterial<Self>, Error> {
        let space = self.space;
        wrap(self, space, body)
    }
}

impl<const D: usize, L: PointLaw<D> + Clone + 'static> Simulation<D, NonlocalSolid<L>> {
    /// Creates an evaluator of forces, stresses and energy-momentum, see [`crate::probe`]; create it before
    /// bonds break.
    pub fn evaluator(&self) -> StressEvaluator<D> {
        let solid = self.material.clone().map(|law| Arc::new(law) as Arc<dyn PointLaw<D>>);
        StressEvaluator::for_solid(solid, false, &self.bonds)
    }

    /// First Piola–Kirchhoff stress P of every particle, Pa, in the order of [`Self::displacements`].
    ///
    /// # Errors
    /// [`Error::Parameter`] if bonds have broken: the law needs the complete families.
    pub fn piola(&self) -> Result<Vec<StressTensor<D>>, Error> {
        self.stress().map(|[piola, _]| piola)
    }

    /// Cauchy stress σ = P Fᵀ/J of every particle, Pa, in the order of [`Self::displacements`].
    ///
    /// # Errors
    /// As [`Self::piola`].
    pub fn cauchy(&self) -> Result<Vec<StressTensor<D>>, Error> {
        self.stress().map(|[_, cauchy]| cauchy)
    }

    fn stress(&self) -> Result<[Vec<StressTensor<D>>; 2], Error> {
        let found = self.state.fracture.broken as f64;
        if found > 0.0 {
            let allowed = "0; where bonds break, create an `evaluator` before they do".into();
            return Err(Error::Parameter { name: "broken bonds", found, allowed });
        }
        Ok(self.evaluator().stress(&self.bonds, &self.state).unwrap_or_default())
    }
}
