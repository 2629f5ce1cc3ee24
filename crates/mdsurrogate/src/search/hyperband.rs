//! Hyperband (Li et al. 2018, Algorithm 1, <https://jmlr.org/papers/v18/16-558.html>).

use super::{Journal, Oracle, SearchCandidate, SearchMethod, SearchSpace, ask};
use crate::Error;
use crate::random::SplitMix64;

/// Returns candidates and epochs of each round of each bracket: with R epochs at most, s_max = ⌊log_η R⌋ and
/// B = (s_max + 1)R, bracket s starts with n = ⌈B/R · ηˢ/(s + 1)⌉ candidates for r = R/ηˢ epochs, and
/// continues one in η for η times as many epochs.
///
/// # Errors
/// Returns [`Error::Parameter`] for less than one epoch, or η below 2.
pub fn brackets(epochs: u32, eta: u32) -> Result<Vec<Vec<(usize, u32)>>, Error> {
    if !(1..=1_000_000).contains(&epochs) {
        return Err(Error::parameter("epochs", epochs, "1 to 1,000,000"));
    }
    if !(2..=100).contains(&eta) {
        return Err(Error::parameter("eta", eta, "2 to 100"));
    }
    let mut most = 0;
    while u64::from(eta).pow(most + 1) <= u64::from(epochs) {
        most += 1;
    }
    let bracket = |s: u32| {
        let power = u64::from(eta).pow(s);
        let n = ((u64::from(most) + 1) * power).div_ceil(u64::from(s) + 1);
        let round = |i: u32| {
            let kept = (n / u64::from(eta).pow(i)).max(1) as usize;
            // R/ηˢ may not be an integer
            let trained = u64::from(epochs) * u64::from(eta).pow(i) / power;
            (kept, trained.max(1) as u32)
        };
        (0..=s).map(round).collect()
    };
    Ok((0..=most).rev().map(bracket).collect())
}

/// Searches by Hyperband with `epochs` at most and the reduction factor `eta`.
///
/// # Errors
/// Returns the errors of [`brackets`], [`SearchSpace::check`] and the oracle.
pub fn hyperband(
    space: &SearchSpace,
    epochs: u32,
    eta: u32,
    seed: u64,
    journal: &mut Journal,
    oracle: &mut dyn Oracle,
) -> Result<(), Error> {
    space.check()?;
    let mut random = SplitMix64::new(seed);
    let mut count = 0;
    for bracket in brackets(epochs, eta)? {
        let [(begun, _), ..] = bracket[..] else { continue };
        let mut alive: Vec<(usize, SearchCandidate)> =
            (count..count + begun).map(|number| (number, space.sample(&mut random))).collect();
        count += begun;
        for (round, &(_, trained)) in bracket.iter().enumerate() {
            let mut losses = Vec::with_capacity(alive.len());
            for (number, candidate) in &alive {
                let loss = ask(oracle, journal, SearchMethod::Hyperband, *number, candidate, trained)?;
                losses.push(loss.unwrap_or(f64::INFINITY));
            }
            let kept = bracket.get(round + 1).map_or(0, |(kept, _)| *kept);
            let mut order: Vec<usize> = (0..alive.len()).collect();
            // stable sort: the earlier of equal losses
            order.sort_by(|&a, &b| losses[a].total_cmp(&losses[b]));
            let dropped: Vec<usize> = order.iter().skip(kept).map(|&k| alive[k].0).collect();
            oracle.forget(SearchMethod::Hyperband, &dropped);
            let mut chosen = order[..kept.min(order.len())].to_vec();
            // diverged candidates do not continue
            chosen.retain(|&k| losses[k].is_finite());
            alive = chosen.into_iter().map(|k| alive[k].clone()).collect();
        }
    }
    Ok(())
}
