//! Models as files: safetensors with a header in JSON.
//!
//! Metadata `mdsurrogate law 1`: the [`Header`] as JSON. Tensors `member0.layer0.weight` (outputs, inputs)
//! and `member0.layer0.bias` (outputs), F64 or F32, little endian, for each member and layer.

use super::{Header, Surrogate};
use crate::constitutive::Error;
use crate::constitutive::network::{Layer, Network};
use safetensors::tensor::{Dtype, SafeTensors, TensorView};
use std::collections::HashMap;
use std::io::Write;
use std::path::Path;

/// Key of the header, and version of the format.
const KEY: &str = "mdsurrogate law 1";

/// Largest size of a file, bytes.
const LARGEST: u64 = 4 << 30;

impl Surrogate<f64> {
    /// Writes the law; an error leaves no partial file.
    ///
    /// # Errors
    /// I/O errors.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), crate::Error> {
        let path = path.as_ref();
        let bytes = self.to_bytes().map_err(|error| Error::file(path, error, "a law that can be written"))?;
        crate::file::atomic_write(path, |file| file.write_all(&bytes))
    }

    /// Reads a law, to the bit.
    ///
    /// # Errors
    /// [`Error::File`] for a file that is not safetensors or lacks our header, and for weights that do not
    /// fit the architecture of the header; I/O errors.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, crate::Error> {
        let path = path.as_ref();
        let size = std::fs::metadata(path).map_err(crate::Error::from_io("read", path))?.len();
        if size > LARGEST {
            return Err(Error::file(path, format!("{size} bytes"), "laws up to 4 GiB").into());
        }
        let bytes = std::fs::read(path).map_err(crate::Error::from_io("read", path))?;
        Ok(Self::decode(&bytes).map_err(|(found, allowed)| Error::file(path, found, allowed))?)
    }

    /// Serialises the law to the bytes of its file.
    ///
    /// # Errors
    /// Reason for which the law cannot be written.
    pub fn to_bytes(&self) -> Result<Vec<u8>, String> {
        let mut data = Vec::new();
        for (m, member) in self.members.iter().enumerate() {
            for (l, layer) in member.layers().iter().enumerate() {
                let bytes = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
                let outputs = layer.bias.len();
                let shape = vec![outputs, layer.weights.len() / outputs];
                data.push((format!("member{m}.layer{l}.weight"), shape, bytes(&layer.weights)));
                data.push((format!("member{m}.layer{l}.bias"), vec![outputs], bytes(&layer.bias)));
            }
        }
        let views = data.iter().map(|(name, shape, bytes)| {
            TensorView::new(Dtype::F64, shape.clone(), bytes).map(|view| (name.as_str(), view))
        });
        let views = views.collect::<Result<Vec<_>, _>>().map_err(|error| error.to_string())?;
        let header = serde_json::to_string(&self.header).map_err(|error| error.to_string())?;
        let metadata = HashMap::from([(KEY.to_owned(), header)]);
        safetensors::serialize(views, Some(metadata)).map_err(|error| error.to_string())
    }

    /// Reads a law from the bytes of a file.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the errors of [`Self::read`].
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        Self::decode(bytes).map_err(|(found, allowed)| Error::invalid("law", found, allowed))
    }

    fn decode(bytes: &[u8]) -> Result<Self, (String, String)> {
        let fail = |found: String, allowed: &str| (found, allowed.to_owned());
        let none = |error: safetensors::SafeTensorError| {
            fail(format!("no safetensors file ({error})"), "a law that this program wrote")
        };
        let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(none)?;
        let tensors = SafeTensors::deserialize(bytes).map_err(none)?;
        let header = metadata.metadata().as_ref().and_then(|map| map.get(KEY)).ok_or_else(|| {
            fail(format!("safetensors without the metadata `{KEY}`"), "a law that this program wrote")
        })?;
        let header: Header = serde_json::from_str(header)
            .map_err(|error| fail(format!("a header that cannot be read ({error})"), KEY))?;
        let unfit = |error: Error| fail(error.to_string(), "header and weights that fit together");
        header.check().map_err(unfit)?;
        let mut members = Vec::new();
        let mut known = 0;
        for m in 0..header.members {
            let mut layers = Vec::new();
            for (l, &activation) in header.architecture.activations.iter().enumerate() {
                let (inputs, outputs) = (header.architecture.widths[l], header.architecture.widths[l + 1]);
                let weights = numbers(&tensors, &format!("member{m}.layer{l}.weight"), &[outputs, inputs])?;
                let bias = numbers(&tensors, &format!("member{m}.layer{l}.bias"), &[outputs])?;
                known += 2;
                layers.push(Layer { weights, bias, activation });
            }
            members.push(Network::new(header.architecture.clone(), layers).map_err(unfit)?);
        }
        if tensors.len() != known {
            let found = format!("{} tensors", tensors.len());
            return Err((
                found,
                format!(
                    "{known}, for {} members of {} layers",
                    header.members,
                    header.architecture.activations.len()
                ),
            ));
        }
        Self::new(header, members).map_err(unfit)
    }
}

fn numbers(tensors: &SafeTensors, name: &str, shape: &[usize]) -> Result<Vec<f64>, (String, String)> {
    let allowed = || format!("`{name}` of shape {shape:?}, F64 or F32, as the header's widths say");
    let view = tensors.tensor(name).map_err(|_| (format!("no tensor `{name}`"), allowed()))?;
    if view.shape() != shape {
        return Err((format!("`{name}` of shape {:?}", view.shape()), allowed()));
    }
    let data = view.data();
    match view.dtype() {
        Dtype::F64 => Ok(data.as_chunks::<8>().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect()),
        Dtype::F32 => {
            let single = data.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
            Ok(single.map(f64::from).collect())
        }
        other => Err((format!("`{name}` of type {other:?}"), allowed())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::constitutive::network::Activation::Softplus;
    use crate::constitutive::surrogate::{Kind, Support, Symmetry, Workspace};
    use crate::tensor::Voigt;
    use proptest::prelude::*;

    fn law() -> Vec<u8> {
        let kind = Kind::polyconvex_energy(Symmetry::Transverse);
        let mut header = Header::new(kind, &[(3, Softplus), (2, Softplus)], 2);
        header.support = Some(Support::from_rows(&[Voigt::repeat(1.0), Voigt::repeat(2.0)], 2).unwrap());
        header.spread_limit = Some(1e6);
        Surrogate::random(header, 3).unwrap().to_bytes().unwrap()
    }

    /// Reads; what can be read can also be used.
    fn use_it(bytes: &[u8]) {
        if let Ok(law) = Surrogate::from_bytes(bytes) {
            let mut memory = Workspace::default();
            let c = Voigt::new(1.1, 1.0, 0.9, 0.1, 0.0, 0.05);
            if let Ok(prediction) = law.tangent(&c, &mut memory) {
                assert!(prediction.stress.iter().all(|s| s.is_finite()));
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig {
            cases: 400,
            failure_persistence: None,
            ..ProptestConfig::default()
        })]

        /// Changed, lost and surplus bytes, most of them in the header: an error or a law, never a panic.
        #[test]
        fn damaged_files(
            changes in prop::collection::vec((0.0..1.0f64, any::<u8>()), 1..6),
            header in any::<bool>(),
            cut in prop::option::of(0.0..1.0f64),
            digits in any::<bool>(),
        ) {
            let mut bytes = law();
            let header_length = u64::from_le_bytes(bytes[..8].try_into().unwrap()) as usize + 8;
            let length = if header { header_length } else { bytes.len() };
            for (place, byte) in changes {
                let at = (place * length as f64) as usize;
                // digits for digits keep the JSON well formed
                if digits && bytes[at].is_ascii_digit() {
                    bytes[at] = b'0' + byte % 10;
                } else if !digits {
                    bytes[at] = byte;
                }
            }
            if let Some(part) = cut {
                bytes.truncate((part * bytes.len() as f64) as usize);
            }
            use_it(&bytes);
        }
    }

    #[test]
    fn headers_of_before_and_of_other_kinds() {
        let bytes = law();
        let text = String::from_utf8_lossy(&bytes).into_owned();
        assert!(text.contains("polyconvex") && text.contains("support"));
        // a file without the newer entries is the law it was
        let old = "{\"kind\":{\"energy\":{\"symmetry\":\"isotropic\",\"axes\":[[1,0,0],[0,1,0],[0,0,1]]}},\
            \"architecture\":{\"widths\":[3,1],\"activations\":[\"linear\"]},\"members\":1,\
             \"input_mean\":[0,0,0],\
            \"input_deviation\":[1,1,1],\"output_mean\":[0],\"output_deviation\":[1],\
            \"training_box\":[[1,1],[1,1],[1,1],[0,0],[0,0],[0,0]],\"spread_limit\":null}";
        let header: Header = serde_json::from_str(old).unwrap();
        header.check().unwrap();
        assert_eq!((header.kind, header.support), (Kind::energy(Symmetry::Isotropic), None));
    }
}
