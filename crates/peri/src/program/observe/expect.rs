//! Names of the scalars that the report of a scene can have, and checks of expectations against them.

use super::list::quantities;
use super::probes::probe_scalars;
use crate::program::quantities as q;
use crate::program::scene::{self, Scene, SceneVariant, variants};
use harness::observe::Scalars;
use harness::report::Named;
use harness::scene::{SceneError, Source};

/// Returns the names of the scalars that the report of a scene can have, with its variants.
///
/// # Errors
/// As [`super::check`].
pub fn quantities_of(source: &Source, scene: &Scene) -> Result<Vec<String>, SceneError> {
    let variants = variants(source, scene, false)?;
    let mut names = Vec::new();
    let mut families: Vec<(String, usize)> = Vec::new();
    for variant in &variants {
        let fails = variant.of.expect_error.is_some().then(|| Named::from(q::FAILED_AS_EXPECTED));
        let own = quantities(&variant.scene).into_iter().chain(fails).map(|quantity| quantity.name);
        match variants.len() {
            1 => names.extend(own),
            _ => {
                for name in own {
                    let compared = scene.output.compare.as_ref().filter(|c| c.quantity == name).is_some();
                    names.extend(compared.then(|| q::COMPARED.named(&[&name, &variant.name()]).name));
                    names.extend(compared.then(|| q::SAME_EVENTS.named(&[&variant.name()]).name));
                    let is_balance = q::BALANCES.iter().any(|balance| balance.name == name);
                    if is_balance && !names.contains(&name) {
                        names.push(name.clone());
                    }
                    names.push(scene::NAMING.value(&variant.of.name, &name));
                }
            }
        }
        match families.iter_mut().find(|(family, _)| *family == variant.family()) {
            Some((_, count)) => *count += 1,
            None => families.push((variant.family(), 1)),
        }
    }
    for (family, _) in families.iter().filter(|(_, count)| *count > 1) {
        names.push(q::PEAK_LOAD_CHANGE.named(&[family]).name);
        for measure in scene.stress.iter().flat_map(|stress| &stress.measures) {
            let kinds = scene.exact.iter().flat_map(|exact| exact.errors());
            names.extend(kinds.map(|kind| q::MEASURE_ORDER.named(&[measure.name(), kind, family]).name));
        }
    }
    names.extend(scene.comparisons().names().map(|quantity| quantity.name));
    if scene.output.integrals {
        names.extend(q::INTEGRALS.iter().map(|quantity| quantity.name.to_owned()));
    }
    names.extend(scene.exact.as_ref().map(|_| q::KT_FINITE_WIDTH.name.to_owned()));
    Ok(names)
}

/// Checks a scene and returns its variants; refuses expectations of scalars that the report lacks, and probes
/// whose values have names of other scalars.
///
/// # Errors
/// As [`scene::check`]; an unknown name, with the most similar ones.
pub fn check(source: &Source, scene: &Scene, quick: bool) -> Result<Vec<SceneVariant>, SceneError> {
    let variants = scene::check(source, scene, quick)?;
    for variant in &variants {
        if variant.of.expect_error.is_none() {
            let (source, scene) = variant.resolved();
            check_probe_names(source, scene)?;
        }
    }
    if !scene.expect.is_empty() {
        let names = quantities_of(source, scene)?;
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        harness::case::check_quantities(source, &scene.expect, &known, |_| false)?;
    }
    Ok(variants)
}

/// Refuses probes whose values have names of other scalars.
fn check_probe_names(source: &Source, scene: &Scene) -> Result<(), SceneError> {
    if scene.probe.is_empty() {
        return Ok(());
    }
    let others = Scene { probe: Vec::new(), ..scene.clone() };
    let mut taken: Vec<String> = quantities(&others).into_iter().map(|named| named.name).collect();
    for (index, probe) in scene.probe.iter().enumerate() {
        let mut own = Vec::new();
        probe_scalars::<2>(probe, 0, &mut Scalars::new(None, &mut |named, _| own.push(named.name)));
        if let Some(value) = own.iter().find(|value| taken.contains(value)) {
            let found = format!("`{}`, whose value `{value}` has the name of another", probe.name);
            return Err(source.error(&format!("probe[{index}].name"), found, "a unique name"));
        }
        taken.extend(own);
    }
    Ok(())
}
