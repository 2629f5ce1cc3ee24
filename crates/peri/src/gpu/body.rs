//! A lattice on a device: its buffers, and the launches of its kernels.

use super::kernels::{CUBE, KernelForm, ROW, SUMS};
use super::pairs::DevicePairs;
use super::planes::DevicePlanes;
use super::{Device, Precision};
use crate::bonds::{BodyGeometry, BondDamage, LatticeBonds, Rational, not_finite};
use crate::error::Error;
use crate::field::Field;
use crate::potential::KernelFit;
use cubecl::client::Client;
use cubecl::prelude::*;
use cubecl::server::{Handle, ServerError};

/// Threads that sum over particles.
pub(super) const THREADS: usize = 1 << 17;
/// Threads of the first fold of ranges, and numbers of each list that the host reads.
pub(super) const FOLDED: usize = 1 << 14;
pub(super) const LANES: usize = 256;
/// Steps that may be taken before the host reads their sums.
pub const MOST_STEPS: usize = 64;
/// Bonds beyond their limit that are listed in one step, from both ends.
pub(super) const LISTED: usize = 1 << 20;
/// Particles of a thread.
const TILE: usize = 2;

/// Loads of a body as its kernels take them.
#[derive(Clone, Copy)]
pub struct DeviceLoads<'a, const D: usize> {
    /// Bit d of a site: component d is held. Empty where all are free.
    pub held: &'a [u8],
    /// Displacement of held components at factor 1, m.
    pub displacement: Option<&'a Field<D>>,
    /// Body force at factor 1, N/m³.
    pub body_force: Option<&'a Field<D>>,
}

/// A lattice with its law on a device.
pub struct DeviceBody<const D: usize> {
    pub(super) client: Client,
    pub(super) precision: Precision,
    pub(super) form: KernelForm,
    pub(super) sites: usize,
    pub(super) particles: usize,
    pub(super) spacing: f64,
    pub(super) volume: f64,
    /// Force density of a unit force on the device, N/m³.
    pub(super) unit: f64,
    /// Δt that velocities are measured in, s.
    pub(super) time_step: f64,
    pub(super) sites_of_particles: Handle,
    pub(super) shifts: Handle,
    pub(super) rows: Handle,
    pub(super) law: Handle,
    pub(super) law_numbers: usize,
    pub(super) intact: Handle,
    pub(super) held: Handle,
    pub(super) full: Handle,
    pub(super) body: Handle,
    /// Factor of the body forces in the present forces.
    pub(super) loading: f64,
    factors: Handle,
    pub(super) fields: [Handle; 3],
    pub(super) kept: Option<[Handle; 3]>,
    pub(super) partial: Handle,
    pub(super) sums: Handle,
    pub(super) ranges: Handle,
    pub(super) folded: Handle,
    pub(super) extremes: Handle,
    pub(super) count: Handle,
    pub(super) list: Handle,
    pub(super) elongations: Handle,
    pub(super) planes: Option<DevicePlanes<D>>,
    pub(super) pairs: Option<DevicePairs>,
}

impl<const D: usize> DeviceBody<D> {
    /// Refuses a list with other than one number a site.
    pub(super) fn refuse_other_sites(&self, what: &str, values: &[f64]) -> Result<(), Error> {
        if values.len() == self.sites {
            return Ok(());
        }
        let (found, sites) = (values.len(), self.sites);
        Err(Error::Device(format!("found {found} {what}; allowed: {sites}, one for each site")))
    }

    /// Number of words of held components.
    pub(super) fn held_words(&self) -> usize {
        if self.form.held { self.sites } else { 1 }
    }

    /// Puts particles, intact bonds and a law q(e) with its modulus kθ, N/m⁶, on a device, without loads, at
    /// rest, undeformed.
    ///
    /// # Errors
    /// [`Error::Device`] for bonds and laws that kernels do not know, and for a body that the device's memory
    /// does not hold.
    pub fn new(
        device: &Device,
        bonds: &LatticeBonds<D>,
        law: &KernelFit,
        modulus: f64,
    ) -> Result<Self, Error> {
        if bonds.has_softened() {
            return Err(Error::Device(
                "unexpected bonds that soften: only the processor does that".to_owned(),
            ));
        }
        let (factors, even) = bonds.factors().unzip();
        let components = factors.map_or(0, |_| if even == Some(true) { 1 } else { D });
        let precision = device.precision;
        let (sites, particles) = (bonds.sites(), bonds.particles().len());
        let stencil = bonds.stencil_bonds(modulus);
        let form = KernelForm {
            dimension: D,
            bonds: stencil.len(),
            tabulated: false,
            numerator: 1,
            denominator: 0,
            clamped: false,
            stressed: false,
            held: false,
            loaded: false,
            factors: components,
            tile: TILE,
            unroll: 2,
        };
        device.refuse_large(bonds, 0)?;
        let spacing = bonds.spacing();
        let unit = spacing * stencil.iter().map(|bond| bond.stiffness.abs()).fold(0.0, f64::max);
        let mut rows = Vec::with_capacity(form.bonds * (D + ROW));
        for (bond, offset) in stencil.iter().zip(&bonds.stencil().offsets) {
            let offset = offset.map(f64::from);
            let square: f64 = offset.iter().map(|x| x * x).sum();
            rows.extend(offset);
            rows.extend([1.0 / square, bond.stiffness * spacing / unit]);
        }
        let client = device.client.clone();
        let shifts: Vec<i32> = stencil.iter().map(|bond| bond.shift as i32).collect();
        let bytes = precision.bytes() as usize;
        let whole = |list: &[u32]| client.create_from_slice(u32::as_bytes(list));
        let empty = |length: usize| client.empty(length * bytes);
        let zeros = Field::<D>::zeros(sites);
        let threads = particles.min(THREADS);
        let ranges = 2 * cubes(particles, form.tile) * CUBE;
        let mut body = Self {
            precision,
            form,
            sites,
            particles,
            spacing,
            volume: bonds.volume(0),
            unit,
            time_step: 0.0,
            sites_of_particles: whole(bonds.particles()),
            shifts: client.create_from_slice(i32::as_bytes(&shifts)),
            rows: numbers(&client, precision, rows.into_iter()),
            law: empty(1),
            law_numbers: 1,
            intact: whole(&halves(&bonds.intact(), sites, form.bonds)),
            held: whole(&[0]),
            full: empty(1),
            body: empty(1),
            loading: 0.0,
            factors: factor_list(&client, precision, factors, components),
            fields: std::array::from_fn(|_| upload(&client, precision, &zeros, 1.0)),
            kept: None,
            partial: empty(SUMS * threads),
            sums: empty(MOST_STEPS * SUMS * LANES),
            ranges: empty(ranges),
            // kernels take the length of a list from its buffer
            folded: empty(2 * (ranges / 2).min(FOLDED)),
            extremes: empty(2 * LANES),
            count: whole(&[0]),
            list: client.empty(4 * 2 * LISTED),
            elongations: empty(LISTED),
            planes: None,
            pairs: None,
            client,
        };
        body.set_law(law, f64::INFINITY)?;
        Ok(body)
    }

    /// Takes another law for the same modulus; bonds with e above `limit` are listed.
    ///
    /// # Errors
    /// [`Error::Device`] for forces that are 0 or not finite.
    pub fn set_law(&mut self, fit: &KernelFit, limit: f64) -> Result<(), Error> {
        if !(self.unit > 0.0 && self.unit.is_finite()) {
            let found = format!("law of the bonds: found a force of {} N/m³; allowed: above 0", self.unit);
            return Err(Error::Device(found));
        }
        let ratio = Rational::new(fit);
        let (numerator, denominator, constant) = match &ratio {
            Some(ratio) => (&ratio.numerator[..], &ratio.denominator[..], ratio.constant),
            None => (&[][..], &[][..], 0.0),
        };
        self.form = KernelForm {
            tabulated: ratio.is_none(),
            numerator: numerator.len(),
            denominator: denominator.len(),
            clamped: fit.clamp.iter().any(|end| end.is_finite()),
            stressed: constant != 0.0,
            ..self.form
        };
        let ends = [constant, fit.clamp[0], fit.clamp[1], limit];
        let coefficients = numerator.iter().chain(denominator).chain(&ends);
        let law: Vec<f64> = coefficients.chain(fit.nodes().iter().flatten()).copied().collect();
        self.law_numbers = law.len();
        self.law = numbers(&self.client, self.precision, law.into_iter());
        Ok(())
    }

    /// Takes loads.
    pub fn set_loads(&mut self, loads: &DeviceLoads<D>) {
        let (client, precision) = (&self.client, self.precision);
        self.form.held = !loads.held.is_empty();
        self.form.loaded = loads.body_force.is_some();
        if self.form.held {
            let held: Vec<u32> = loads.held.iter().map(|&bits| bits.into()).collect();
            self.held = client.create_from_slice(u32::as_bytes(&held));
            let zeros = Field::zeros(self.sites);
            let full = loads.displacement.unwrap_or(&zeros);
            self.full = upload(client, precision, full, 1.0 / self.spacing);
        }
        if let Some(body) = loads.body_force {
            self.body = upload(client, precision, body, 1.0 / self.unit);
        }
    }

    /// Takes intact bonds, displacement, m, velocity, m/s, and force density, N/m³; `time_step`, s, is that
    /// of velocities on the device.
    ///
    /// # Errors
    /// [`Error::Geometry`] for the fields of another body.
    pub fn set_state(
        &mut self,
        bonds: &LatticeBonds<D>,
        [displacement, velocity, force]: [&Field<D>; 3],
        time_step: f64,
    ) -> Result<(), Error> {
        self.fits(&[displacement.sites(), velocity.sites(), force.sites(), bonds.sites()])?;
        self.time_step = time_step;
        self.set_intact(bonds);
        let scales = [1.0 / self.spacing, time_step / self.spacing, 1.0 / self.unit];
        let fields = [displacement, velocity, force];
        self.fields = std::array::from_fn(|k| upload(&self.client, self.precision, fields[k], scales[k]));
        Ok(())
    }

    /// Takes the bonds left to all particles.
    pub fn set_intact(&mut self, bonds: &LatticeBonds<D>) {
        let intact = halves(&bonds.intact(), self.sites, self.form.bonds);
        self.intact = self.client.create_from_slice(u32::as_bytes(&intact));
    }

    /// Displacement, m, velocity, m/s, and force density with body forces, N/m³.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn state(&self) -> Result<[Field<D>; 3], Error> {
        let speed = if self.time_step > 0.0 { self.spacing / self.time_step } else { 0.0 };
        let [displacement, velocity, force] = &self.fields;
        Ok([
            self.download(displacement, self.spacing)?,
            self.download(velocity, speed)?,
            self.download(force, self.unit)?,
        ])
    }

    /// Force densities, N/m³, in a displacement, m, without body forces.
    ///
    /// # Errors
    /// [`Error::NotFinite`] for forces that are not finite; [`Error::Geometry`] for the field of another
    /// body; [`Error::Device`] where the device fails.
    pub fn force(&self, bonds: &LatticeBonds<D>, displacement: &Field<D>) -> Result<Field<D>, Error> {
        self.fits(&[displacement.sites(), bonds.sites()])?;
        let there = upload(&self.client, self.precision, displacement, 1.0 / self.spacing);
        let found = upload(&self.client, self.precision, &Field::<D>::zeros(self.sites), 1.0);
        let form = KernelForm { loaded: false, ..self.form };
        self.launch_pull([&there, &found], (&self.sites_of_particles, self.particles), 0.0, form, false);
        let force = self.download(&found, self.unit)?;
        match force.non_finite() {
            Some((site, _)) => Err(not_finite(bonds, "force", site, 0, 0)),
            None => Ok(force),
        }
    }

    /// Δt that velocities are measured in, s.
    pub fn time_step(&self) -> f64 {
        self.time_step
    }

    fn fits(&self, lengths: &[usize]) -> Result<(), Error> {
        if lengths.iter().all(|&length| length == self.sites) {
            return Ok(());
        }
        Err(Error::geometry(format!("fields over {lengths:?} sites for a body of {}", self.sites)))
    }
}

impl<const D: usize> DeviceBody<D> {
    /// Body forces.
    pub(super) fn loads(&self) -> BufferArg {
        super::steps::buffer(&self.body, if self.form.loaded { D * self.sites } else { 1 })
    }

    /// Factors of particles as kernels take them.
    pub(super) fn factors(&self) -> BufferArg {
        super::steps::buffer(&self.factors, (self.form.factors * self.sites).max(1))
    }

    pub(super) fn download(&self, from: &Handle, scale: f64) -> Result<Field<D>, Error> {
        let values = self.values(from)?;
        let mut field = Field::zeros(self.sites);
        for (to, from) in field.components_mut().into_iter().zip(values.chunks(self.sites)) {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from * scale);
        }
        Ok(field)
    }

    /// Numbers of a buffer.
    pub(super) fn values(&self, from: &Handle) -> Result<Vec<f64>, Error> {
        let bytes = self.client.read_one(from.clone()).map_err(|error| failed(&error))?;
        Ok(match self.precision {
            Precision::Single => f32::from_bytes(&bytes).iter().map(|&x| f64::from(x)).collect(),
            Precision::Double => f64::from_bytes(&bytes).to_vec(),
        })
    }
}

/// Cubes of threads with `tile` particles each.
pub(super) fn cubes(particles: usize, tile: usize) -> usize {
    particles.div_ceil(CUBE * tile)
}

/// Words of 64 bonds, each over all sites, as words of 32.
fn halves(words: &[u64], sites: usize, bonds: usize) -> Vec<u32> {
    let half = |word: usize| {
        words[word / 2 * sites..][..sites].iter().map(move |bits| (bits >> (32 * (word % 2))) as u32)
    };
    (0..bonds.div_ceil(32)).flat_map(half).collect()
}

/// The first components of factors; one number without any.
fn factor_list<const D: usize>(
    client: &Client,
    precision: Precision,
    factors: Option<&Field<D>>,
    components: usize,
) -> Handle {
    let Some(factors) = factors else { return numbers(client, precision, std::iter::once(1.0)) };
    let list = factors.components().into_iter().take(components).flatten().copied();
    numbers(client, precision, list)
}

fn upload<const D: usize>(client: &Client, precision: Precision, field: &Field<D>, scale: f64) -> Handle {
    numbers(client, precision, field.components().into_iter().flatten().map(|x| x * scale))
}

pub(super) fn numbers(client: &Client, precision: Precision, values: impl Iterator<Item = f64>) -> Handle {
    match precision {
        // not beyond the range of single precision: ends of a law may be infinite, and no kernel has to know
        // that
        Precision::Single => {
            let single = |x: f64| if x.is_infinite() { f32::MAX.copysign(x as f32) } else { x as f32 };
            client.create_from_slice(f32::as_bytes(&values.map(single).collect::<Vec<_>>()))
        }
        Precision::Double => client.create_from_slice(f64::as_bytes(&values.collect::<Vec<_>>())),
    }
}

pub(super) fn failed(error: &ServerError) -> Error {
    let text = error.to_string();
    Error::Device(text.split("\nBacktrace").next().unwrap_or_default().to_owned())
}

impl Device {
    /// Refuses a lattice whose buffers this device does not hold; L-BFGS keeps `pairs` steps, other methods
    /// none.
    ///
    /// # Errors
    /// [`Error::Device`] with the buffer, its bytes and those of the device.
    pub fn refuse_large<const D: usize>(&self, bonds: &LatticeBonds<D>, pairs: usize) -> Result<(), Error> {
        let list = (D * bonds.sites()) as u64;
        let field = list * self.precision.bytes();
        let words = 4 * (bonds.sites() * bonds.stencil().offsets.len().div_ceil(32)) as u64;
        let buffers = [
            ("displacement", field),
            ("velocity", field),
            ("force", field),
            ("factors of bonds", bonds.factors().map_or(0, |_| field)),
            ("intact bonds", words),
            // differences of displacements and of forces
            ("steps of L-BFGS", 4 * pairs as u64 * list),
            ("steps of L-BFGS", 4 * pairs as u64 * list),
        ];
        self.refuse_buffers(&buffers)
    }

    /// Refuses buffers, bytes each by name, that this device does not hold.
    pub(super) fn refuse_buffers(&self, buffers: &[(&str, u64)]) -> Result<(), Error> {
        let (name, one) = (self.name(), self.largest_buffer());
        if let Some((what, bytes)) = buffers.iter().find(|(_, bytes)| *bytes > one) {
            let found = format!("{what}: found {bytes} bytes; allowed: {one} in a buffer of {name}");
            return Err(Error::Device(found));
        }
        let total = buffers.iter().map(|(_, bytes)| bytes).sum::<u64>();
        match self.client.properties().memory.max_memory().filter(|all| total > *all) {
            Some(all) => Err(Error::Device(format!("memory: found {total} bytes; allowed: {all} on {name}"))),
            None => Ok(()),
        }
    }
}
