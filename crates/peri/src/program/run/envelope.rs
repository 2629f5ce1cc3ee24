//! What a test machine records of equilibria that snap back.

/// The greatest load at each displacement of a path of equilibria, displacements and loads, linear between them; at the greatest
/// displacement the fall to the load at the end of the path. Displacements, ascending, and loads.
pub fn envelope(path: &[[f64; 2]]) -> [Vec<f64>; 2] {
    let mut at: Vec<f64> = path.iter().map(|point| point[0]).collect();
    at.sort_by(f64::total_cmp);
    at.dedup();
    let greatest = |u: f64| {
        let mut most = f64::NEG_INFINITY;
        for ends in path.windows(2) {
            let [[a, before], [b, after]] = [ends[0], ends[1]];
            if a.min(b) <= u && u <= a.max(b) {
                let part = (u - a) / (b - a);
                most = most.max(if a == b { before.max(after) } else { before + part * (after - before) });
            }
        }
        most
    };
    let mut load: Vec<f64> = at.iter().map(|&u| greatest(u)).collect();
    if let (Some(&most), Some(end)) = (at.last(), path.last())
        && most > end[0]
    {
        at.push(most);
        load.push(end[1]);
    }
    [at, load]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_machine_sees_the_upper_branch_and_the_fall() {
        // up to 3 N at 3 m, back to 1 m, a second branch that crosses the first one's range, and the end at 2 m
        let path = [[0.0, 0.0], [3.0, 3.0], [1.0, 0.5], [2.0, 2.5], [2.0, 0.0]];
        let [at, load] = envelope(&path);
        assert_eq!(at, [0.0, 1.0, 2.0, 3.0, 3.0]);
        assert_eq!(load, [0.0, 1.0, 2.5, 3.0, 0.0]);
        // without snap back it is the path
        assert_eq!(
            envelope(&[[0.0, 0.0], [1.0, 2.0], [2.0, 1.0]]),
            [vec![0.0, 1.0, 2.0], vec![0.0, 2.0, 1.0]]
        );
    }
}
