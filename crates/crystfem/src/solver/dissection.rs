//! Nested dissection by coordinates: an elimination order that keeps the factors of a mesh small (George
//! 1973, doi:10.1137/0710032).

use polycore::numerics::bounds;

/// Largest number of equations of a part that is not cut further.
const MAX_UNCUT: usize = 64;

/// Returns equations in elimination order. A part is cut across its longest side; equations beyond the cut
/// that are coupled to the other half come last. `neighbours` visits the equations coupled to one.
pub fn order(
    equations: Vec<u32>,
    size: usize,
    place: impl Fn(u32) -> [f64; 3],
    neighbours: impl Fn(u32, &mut dyn FnMut(u32)),
) -> Vec<u32> {
    // side of each equation within the part being cut
    let mut side = vec![0_u8; size];
    let mut reversed = Vec::with_capacity(equations.len());
    let mut parts = vec![equations];
    while let Some(mut part) = parts.pop() {
        let [low, high] = bounds(part.iter().map(|&equation| place(equation)));
        let longest =
            (0..3).fold(0, |best, d| if high[d] - low[d] > high[best] - low[best] { d } else { best });
        let mut across: Vec<f64> = part.iter().map(|&equation| place(equation)[longest]).collect();
        let middle = across.len() / 2;
        let cut =
            if across.is_empty() { 0.0 } else { *across.select_nth_unstable_by(middle, f64::total_cmp).1 };
        // planes of nodes may differ by rounding
        let cut = cut - 1e-9 * (high[longest] - low[longest]);
        let (near, far): (Vec<u32>, Vec<u32>) = part.iter().partition(|&&e| place(e)[longest] < cut);
        if part.len() <= MAX_UNCUT || near.is_empty() {
            part.reverse();
            reversed.append(&mut part);
            continue;
        }
        for &equation in &near {
            side[equation as usize] = 1;
        }
        let (mut separator, mut rest) = (Vec::new(), Vec::new());
        for &equation in &far {
            let mut touches = false;
            neighbours(equation, &mut |other| touches |= side[other as usize] == 1);
            if touches { separator.push(equation) } else { rest.push(equation) }
        }
        for &equation in &near {
            side[equation as usize] = 0;
        }
        separator.reverse();
        reversed.append(&mut separator);
        // filled from the end: first the far half, then the near one, both before the separator
        parts.push(near);
        parts.push(rest);
    }
    reversed.reverse();
    reversed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Order of a grid of 20 × 20 is a permutation; the last equations separate it.
    #[test]
    fn a_square_is_cut_in_the_middle() {
        let place = |e: u32| [f64::from(e % 20), f64::from(e / 20), 0.0];
        let neighbours = |e: u32, visit: &mut dyn FnMut(u32)| {
            for other in 0..400 {
                let (a, b) = (place(e), place(other));
                if (a[0] - b[0]).abs() <= 1.0 && (a[1] - b[1]).abs() <= 1.0 {
                    visit(other);
                }
            }
        };
        let order = order((0..400).collect(), 400, place, neighbours);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, (0..400).collect::<Vec<_>>());
        assert!(order[380..].iter().all(|&e| place(e)[0] == 10.0), "{:?}", &order[380..]);
    }
}
