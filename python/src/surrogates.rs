//! Learnt laws.

use crate::error::{file, value};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2};
use polycore::constitutive::network::{Architecture, Layer, Network};
use polycore::constitutive::surrogate::{self, Header};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use std::path::PathBuf;

/// Law C → S, or W, as `mdsurrogate` writes it.
#[pyclass(frozen, name = "Surrogate", module = "polymech._polymech")]
pub struct LearntLaw {
    law: surrogate::Surrogate,
}

/// W and b of each layer.
type MemberWeights<'py> = Vec<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray1<f64>>)>;

#[pymethods]
impl LearntLaw {
    /// Reads a model from the bytes of a file.
    #[new]
    fn new(bytes: &[u8]) -> PyResult<Self> {
        surrogate::Surrogate::from_bytes(bytes).map(|law| Self { law }).map_err(value)
    }

    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| surrogate::Surrogate::read(path)).map(|law| Self { law }).map_err(|error| file(&error))
    }

    /// Builds a model from a header in JSON (its `architecture` and `members` follow from the weights) and W,
    /// (outputs, inputs), and b of each layer of each member.
    #[staticmethod]
    fn build(
        header: &str,
        members: Vec<Vec<(PyReadonlyArray2<'_, f64>, PyReadonlyArray1<'_, f64>)>>,
    ) -> PyResult<Self> {
        let header: Header =
            serde_json::from_str(header).map_err(|error| value(format!("header: {error}")))?;
        let networks = members.iter().map(|layers| network(&header.architecture, layers));
        let networks = networks.collect::<PyResult<Vec<_>>>()?;
        surrogate::Surrogate::new(header, networks).map(|law| Self { law }).map_err(value)
    }

    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.law.write(path)).map_err(|error| file(&error))
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyBytes>,)> {
        Ok((PyBytes::new(py, &self.law.to_bytes().map_err(value)?),))
    }

    /// Returns everything but the weights, as JSON.
    fn header(&self) -> PyResult<String> {
        serde_json::to_string(self.law.header()).map_err(value)
    }

    /// Returns W and b of each layer of each member.
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Vec<MemberWeights<'py>>> {
        let of_layer = |layer: &Layer<f64>| {
            let outputs = layer.bias.len();
            let weights = layer.weights.clone().into_pyarray(py);
            let columns = layer.weights.len() / outputs.max(1);
            Ok((weights.reshape([outputs, columns])?, layer.bias.clone().into_pyarray(py)))
        };
        let of_member = |member: &Network<f64>| member.layers().iter().map(of_layer).collect();
        self.law.members().iter().map(of_member).collect()
    }

    #[pyo3(signature = (c, tangent, uncertainty, rounding))]
    fn predict<'py>(
        &self,
        py: Python<'py>,
        c: PyReadonlyArray2<'py, f64>,
        tangent: bool,
        uncertainty: bool,
        rounding: f64,
    ) -> PyResult<Bound<'py, PyDict>> {
        crate::predict::predict(py, &self.law, &c, tangent, uncertainty, rounding)
    }
}

fn network(
    architecture: &Architecture,
    layers: &[(PyReadonlyArray2<'_, f64>, PyReadonlyArray1<'_, f64>)],
) -> PyResult<Network<f64>> {
    let layers = layers.iter().zip(&architecture.activations).map(|((weights, bias), &activation)| {
        let weights = weights.as_array().iter().copied().collect();
        Layer { weights, bias: bias.as_array().to_vec(), activation }
    });
    let layers: Vec<Layer<f64>> = layers.collect();
    Network::new(architecture.clone(), layers).map_err(value)
}
