//! Observers of a run: probes, lines, sections, fields, couplings, pictures. Each declares the scalars and
//! fields that it provides, sees every accepted step, and writes its results at the end; the checkpoint keeps
//! what it has seen.

use crate::report::Named;
use polycore::Error;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Watches a run whose state is an `S`; `E` is the error of the program.
///
/// `[[expect]]`, `check` and the field file know an observer by what [`scalars`](Self::scalars) and
/// [`fields`](Self::fields) name, so a scalar or a field is written down once.
pub trait Observer<S: ?Sized, E> {
    /// Names its scalars and how each follows from the final state.
    fn scalars(&self, _to: &mut Scalars<S>) {}

    /// Names its fields and how each follows from a state.
    fn fields(&self, _to: &mut Fields<S>) {}

    /// Curves for the report, of the final state.
    fn curves(&self, _state: &S) -> Vec<Curve> {
        Vec::new()
    }

    /// Sentences on what is allowed and most likely not meant, of the final state.
    fn warnings(&self, _state: &S) -> Vec<String> {
        Vec::new()
    }

    /// Counts of its work.
    fn work(&self, _state: &S) -> Vec<(&'static str, u64)> {
        Vec::new()
    }

    /// Sees the initial state and every accepted step.
    ///
    /// # Errors
    /// A result that is not finite, a coupled solution that fails.
    fn see(&mut self, _state: &S) -> Result<(), E> {
        Ok(())
    }

    /// Completes its results at the end of the run, before scalars and fields are taken.
    ///
    /// # Errors
    /// As [`Self::see`].
    fn end(&mut self, _state: &S) -> Result<(), E> {
        Ok(())
    }

    /// Writes its tables.
    ///
    /// # Errors
    /// Files that cannot be written.
    fn write(&self, _state: &S, _to: &Outputs) -> Result<(), E> {
        Ok(())
    }

    /// Writes its pictures, where the scene asks for them.
    ///
    /// # Errors
    /// Files that cannot be written.
    fn draw(&self, _state: &S, _to: &Outputs) -> Result<(), E> {
        Ok(())
    }

    /// Returns the state of the observer, for the checkpoint.
    fn save(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Takes back what [`Self::save`] gave.
    ///
    /// # Errors
    /// Bytes of another version.
    fn restore(&mut self, _saved: &[u8]) -> Result<(), E> {
        Ok(())
    }
}

/// A curve of a report.
#[derive(Clone, Debug)]
pub struct Curve {
    /// Name.
    pub name: String,
    /// Columns: name, unit, values.
    pub columns: Vec<(&'static str, &'static str, Vec<f64>)>,
}

/// Bytes of what an observer has seen, for [`Observer::save`].
pub fn encode<T: Serialize>(seen: &T) -> Vec<u8> {
    // lists and numbers in memory: nothing that postcard refuses; `decode` refuses bytes that are missing
    postcard::to_stdvec(seen).unwrap_or_default()
}

/// Decodes bytes of [`encode`].
///
/// # Errors
/// [`Error::Format`] for bytes of another version.
pub fn decode<T: DeserializeOwned>(saved: &[u8]) -> Result<T, Error> {
    postcard::from_bytes(saved).map_err(|error| Error::Format {
        path: crate::checkpoint::FILE_NAME.into(),
        format: "checkpoint",
        reason: error.to_string(),
    })
}

/// Destination of the files of observers.
#[derive(Clone, Copy, Debug)]
pub struct Outputs<'a> {
    /// Output folder of the run.
    pub folder: &'a Path,
    /// True if the scene asks for pictures.
    pub pictures: bool,
}

/// Scalars of observers: their names before a run, their values after it.
pub struct Scalars<'a, S: ?Sized> {
    state: Option<&'a S>,
    take: &'a mut dyn FnMut(Named, f64),
}

impl<'a, S: ?Sized> Scalars<'a, S> {
    /// Takes values at `state`, names with NaN where there is no state yet.
    pub fn new(state: Option<&'a S>, take: &'a mut dyn FnMut(Named, f64)) -> Self {
        Self { state, take }
    }

    /// Adds a scalar; `value` is not computed where names alone are asked for.
    pub fn add(&mut self, quantity: impl Into<Named>, value: impl FnOnce(&S) -> f64) {
        let value = self.state.map_or(f64::NAN, value);
        (self.take)(quantity.into(), value);
    }

    /// Adds a scalar that not every run has: none is reported without a value.
    pub fn add_if(&mut self, quantity: impl Into<Named>, value: impl FnOnce(&S) -> Option<f64>) {
        match self.state.map(value) {
            None => (self.take)(quantity.into(), f64::NAN),
            Some(Some(value)) => (self.take)(quantity.into(), value),
            Some(None) => {}
        }
    }

    /// Adds a scalar whose unit only the result knows.
    pub fn add_in_unit(
        &mut self,
        quantity: impl Into<Named>,
        value: impl FnOnce(&S) -> Option<(&'static str, f64)>,
    ) {
        match self.state.map(value) {
            None => (self.take)(quantity.into(), f64::NAN),
            Some(Some((unit, value))) => (self.take)(quantity.into().in_unit(unit), value),
            Some(None) => {}
        }
    }
}

/// Places of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// Nodes or particles.
    Points,
    /// Elements.
    Cells,
}

/// Values of a field at all places, the components of a place together.
#[derive(Clone, Debug)]
pub struct Field {
    /// Name in the file, with its unit where it has one.
    pub name: String,
    /// Components at each place: 1, 3, 6 or 9.
    pub components: usize,
    /// Place of the values.
    pub place: Place,
    /// Values; NaN where the field does not exist. Empty where names alone are asked for.
    pub values: Vec<f64>,
}

/// Fields of observers: their names before a run, their values at a state.
pub struct Fields<'a, S: ?Sized> {
    state: Option<&'a S>,
    /// Fields in the order of the observers.
    pub each: Vec<Field>,
}

impl<'a, S: ?Sized> Fields<'a, S> {
    /// Takes values at `state`.
    pub fn new(state: Option<&'a S>) -> Self {
        Self { state, each: Vec::new() }
    }

    /// Adds a field.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        components: usize,
        place: Place,
        values: impl FnOnce(&S) -> Vec<f64>,
    ) {
        let values = self.state.map_or(Vec::new(), values);
        self.each.push(Field { name: name.into(), components, place, values });
    }
}

/// The observers of a run, in the order of their output.
pub struct Observers<'a, S: ?Sized, E>(pub Vec<Box<dyn Observer<S, E> + Send + 'a>>);

impl<S: ?Sized, E> Observers<'_, S, E> {
    /// Returns names of all scalars.
    pub fn names(&self) -> Vec<Named> {
        let mut names = Vec::new();
        let take = &mut |named, _| names.push(named);
        self.0.iter().for_each(|observer| observer.scalars(&mut Scalars::new(None, take)));
        names
    }

    /// Gives all scalars of the final state to `take`.
    pub fn scalars(&self, state: &S, take: &mut dyn FnMut(Named, f64)) {
        self.0.iter().for_each(|observer| observer.scalars(&mut Scalars::new(Some(state), take)));
    }

    /// Fields of a state.
    pub fn fields(&self, state: &S) -> Vec<Field> {
        let mut fields = Fields::new(Some(state));
        self.0.iter().for_each(|observer| observer.fields(&mut fields));
        fields.each
    }

    /// Shows an accepted step to all.
    ///
    /// # Errors
    /// That of the first observer that fails.
    pub fn see(&mut self, state: &S) -> Result<(), E> {
        self.0.iter_mut().try_for_each(|observer| observer.see(state))
    }

    /// Completes all results.
    ///
    /// # Errors
    /// As [`Self::see`].
    pub fn end(&mut self, state: &S) -> Result<(), E> {
        self.0.iter_mut().try_for_each(|observer| observer.end(state))
    }

    /// Writes all tables.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn write(&self, state: &S, to: &Outputs) -> Result<(), E> {
        self.0.iter().try_for_each(|observer| observer.write(state, to))
    }

    /// Writes all pictures.
    ///
    /// # Errors
    /// Files that cannot be written.
    pub fn draw(&self, state: &S, to: &Outputs) -> Result<(), E> {
        self.0.iter().try_for_each(|observer| observer.draw(state, to))
    }

    /// Counts of the work of all.
    pub fn work(&self, state: &S) -> Vec<(&'static str, u64)> {
        self.0.iter().flat_map(|observer| observer.work(state)).collect()
    }

    /// Returns the state of all observers, for the checkpoint.
    pub fn save(&self) -> Vec<Vec<u8>> {
        self.0.iter().map(|observer| observer.save()).collect()
    }

    /// Takes back what [`Self::save`] gave.
    ///
    /// # Errors
    /// As [`Observer::restore`].
    pub fn restore(&mut self, saved: &[Vec<u8>]) -> Result<(), E> {
        self.0.iter_mut().zip(saved).try_for_each(|(observer, saved)| observer.restore(saved))
    }
}
