//! Published constants beside measurements and published solutions.

use std::collections::BTreeMap;

use evidence::near;
use polycore::constitutive::hyperelastic::LopezPamies;
use polycore::constitutive::hyperelastic::data::Mode;
use polycore::constitutive::viscoelastic::{
    Branch, History, Increment, Pace, Reaction, Spring, Viscoelastic, Viscosity, nominal_of_test,
    strain_of_test,
};
use polycore::constitutive::{IsochoricSplit, Law, Workspace};
use polycore::tensor::{Voigt, voigt};

const REST: Voigt = Voigt::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);

/// VHB 4910: Kumar and Lopez-Pamies 2016, doi:10.1016/j.crme.2015.11.004, Table 2.
fn vhb(bulk: Option<f64>) -> Viscoelastic {
    let equilibrium = LopezPamies::new(vec![[13.54e3, 1.0], [1.08e3, -2.474]]).unwrap();
    let law: Box<dyn Law> = match bulk {
        None => Box::new(equilibrium),
        Some(bulk) => Box::new(IsochoricSplit::new(Box::new(equilibrium), bulk).unwrap()),
    };
    let spring = Spring::LopezPamies(LopezPamies::new(vec![[5.42e3, -10.0], [20.78e3, 1.948]]).unwrap());
    let viscosity = Viscosity::KumarLopezPamies {
        start: 7014e3,
        end: 0.1e3,
        thickening: 3507e3,
        thinning: 1e-6,
        exponents: [1.852, 0.26],
    };
    Viscoelastic::new(law, vec![Branch::new(spring, viscosity).unwrap()]).unwrap()
}

/// The published constants against the cycles of Hossain, Vu and Steinmann 2012,
/// doi:10.1016/j.commatsci.2012.02.027 (data: `ConstitutiveANN/vCANN`, MIT): root mean square of each of
/// the 11 runs, kPa, as an independent integration gives it.
#[test]
fn vhb_4910_beside_its_measurements() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let text =
        std::fs::read_to_string(path.join("tests/data/time/vhb4910_uniaxial_hossain2012.csv")).unwrap();
    let mut runs: BTreeMap<(String, String), Vec<[f64; 2]>> = BTreeMap::new();
    for line in text.lines().filter(|line| line.starts_with("0.")) {
        let cells: Vec<&str> = line.split(',').collect();
        let point = [cells[3], cells[4]].map(|cell| cell.parse().unwrap());
        runs.entry((cells[0].into(), cells[1].into())).or_default().push(point);
    }
    let published = [0.98, 2.67, 3.17, 2.06, 3.56, 1.73, 3.97, 5.04, 3.64, 4.83, 2.70];
    assert_eq!(runs.len(), published.len());
    let (law, mut sum, mut count) = (vhb(None), 0.0, 0);
    for (((rate, most), points), expected) in runs.iter().zip(published) {
        let rate: f64 = rate.parse().unwrap();
        // time follows from the path of the stretch; the turn is a time of output
        let top = points.iter().enumerate().max_by(|a, b| a.1[0].total_cmp(&b.1[0])).unwrap().0;
        let crest = points[top][0];
        let turn = (crest - 1.0) / rate;
        let time = |k: usize| match k <= top {
            true => (points[k][0] - 1.0) / rate,
            false => turn + (crest - points[k][0]) / rate,
        };
        let stretch = |t: f64| if t <= turn { 1.0 + rate * t } else { crest - rate * (t - turn) };
        let strain = |t: f64| strain_of_test(Mode::Uniaxial, stretch(t));
        let mut times = vec![0.0];
        let mut kept = Vec::new();
        for (k, point) in points.iter().enumerate() {
            if time(k) > times[times.len() - 1] {
                times.push(time(k));
                kept.push(Some(point[1]));
            } else {
                // a point at the start, or digitised out of order: the stress of the state before
                kept.push(None);
            }
        }
        let reaction = Reaction::Test(Mode::Uniaxial);
        let history = History { strain: &strain, temperature: &|_| 293.15, times: &times, reaction };
        let trace = law.follow(&history, law.rest(), Pace::Within(50.0)).unwrap();
        let mut found = trace.points.iter();
        let mut last = 0.0;
        let mut square = 0.0;
        for (kept, point) in kept.iter().zip(points) {
            if kept.is_some() {
                let point = found.next().unwrap();
                last = nominal_of_test(&strain(point.time), &point.step.prediction.stress) / 1e3;
            }
            square += (last - point[1]).powi(2);
        }
        let rms = (square / points.len() as f64).sqrt();
        near(&format!("rms at {rate} /s to {most}, kPa"), rms, expected, 0.05);
        (sum, count) = (sum + square, count + points.len());
    }
    near("rms of all runs, kPa", (sum / count as f64).sqrt(), 3.31, 0.02);
}

/// Time, s; log strain; J; Cauchy stress, MPa; equilibrium and branch energy per deformed volume, MPa: in
/// tension at 0.05 /s to a stretch of 3 and back, computed by the authors for κ = 0.01462 MPa times 1e4 and 1
/// (Lefèvre, Sozio and Lopez-Pamies 2024, doi:10.1016/j.finel.2024.104114; few of their figures).
const UNIAXIAL: [(f64, [[f64; 6]; 4]); 2] = [
    (
        1e4,
        [
            [10.0, 0.405465, 1.000129, 0.0566994, 0.0041818, 0.005767],
            [40.0, 1.098612, 1.000475, 0.208418, 0.045728, 0.020854],
            [50.0, 0.916291, 1.000265, 0.116358, 0.027985, 0.0064258],
            [70.0, 0.405465, 1.000028, 0.0121394, 0.0041818, 0.00074948],
        ],
    ),
    (
        1.0,
        [
            [10.0, 0.405465, 1.518981, 0.0227625, 0.002419, 0.0016589],
            [40.0, 1.098612, 2.250822, 0.054861, 0.014688, 0.005351],
            [50.0, 0.916291, 1.917383, 0.0402364, 0.010671, 0.0022154],
            [70.0, 0.405465, 1.233099, 0.0102237, 0.0025814, 0.00014064],
        ],
    ),
];

/// The compressible law in tension with free sides, beside the authors' solution.
#[test]
fn compressible_tension_beside_a_published_solution() {
    for (ratio, rows) in UNIAXIAL {
        let law = vhb(Some(0.01462e6 * ratio));
        let (mut state, mut memory) = (law.rest(), Workspace::default());
        let (mut c, mut done) = (REST, 0);
        const PER_SECOND: usize = 100;
        for row in rows {
            let end = (row[0] * PER_SECOND as f64).round() as usize;
            let mut last = None;
            for k in done + 1..=end {
                let time = k as f64 / PER_SECOND as f64;
                let stretch = if time <= 40.0 { 1.0 + 0.05 * time } else { 3.0 - 0.05 * (time - 40.0) };
                c[0] = stretch * stretch;
                let mut lateral = c[1];
                // S₂₂ = 0 by Newton's method with the tangent of the step
                let step = loop {
                    (c[1], c[2]) = (lateral, lateral);
                    let increment = Increment::new(c, c, 1.0 / PER_SECOND as f64);
                    let step = law.advance(&state, &increment, &mut memory).unwrap();
                    let d = step.prediction.tangent.unwrap();
                    let change = step.prediction.stress[1] / (0.5 * (d[(1, 1)] + d[(1, 2)]));
                    lateral -= change;
                    if change.abs() < 1e-13 {
                        break step;
                    }
                };
                state = step.state.clone();
                last = Some(step);
            }
            done = end;
            let step = last.unwrap();
            let jacobian = voigt::to_stress(&c).determinant().sqrt();
            let stress = c[0] * step.prediction.stress[0] / jacobian / 1e6;
            let name = |what: &str| format!("κ/μ = {ratio}, {} s: {what}", row[0]);
            near(&name("J"), jacobian / row[2], 1.0, 3e-3);
            near(&name("stress"), stress / row[3], 1.0, 3e-3);
            let isochoric = c / voigt::to_stress(&c).determinant().cbrt();
            let elastic = law.equilibrium().stress(&isochoric, &mut memory).unwrap().energy.unwrap();
            let branch = step.prediction.energy.unwrap()
                - law.equilibrium().stress(&c, &mut memory).unwrap().energy.unwrap();
            near(&name("branch energy"), branch / jacobian / 1e6 / row[5], 1.0, 3e-3);
            let volumetric = 0.5 * 0.01462e6 * ratio * (jacobian - 1.0).powi(2);
            let whole = (elastic + volumetric) / jacobian / 1e6;
            near(&name("equilibrium energy"), whole / row[4], 1.0, 3e-3);
        }
    }
}

/// Rate, 1/s; largest compression; nominal stress, MPa, of the model curve at the stretches 0.9, 0.8, 0.7 and
/// 0.6 in loading, then in unloading: read from Fig. 4 of Kumar and Lopez-Pamies 2016 (± 0.03 MPa).
const NITRILE_RUBBER: [(f64, f64, [[f64; 4]; 2]); 4] = [
    (0.00023, 0.454, [[-0.433, -0.927, -1.547, -2.398], [-0.285, -0.685, -1.197, -1.899]]),
    (0.001, 0.454, [[-0.46, -0.968, -1.606, -2.482], [-0.252, -0.638, -1.131, -1.805]]),
    (0.01, 0.453, [[-0.515, -1.057, -1.736, -2.666], [-0.175, -0.525, -0.97, -1.58]]),
    (0.1, 0.454, [[-0.589, -1.187, -1.93, -2.944], [-0.041, -0.329, -0.696, -1.194]]),
];

/// Nitrile rubber of Bergström and Boyce in compression, with the constants of Table 1.
#[test]
fn nitrile_rubber_beside_the_published_model() {
    const STRETCHES: [f64; 4] = [0.9, 0.8, 0.7, 0.6];
    let equilibrium = LopezPamies::new(vec![[1.08e6, 0.26], [0.017e6, 7.68]]).unwrap();
    let spring = Spring::LopezPamies(LopezPamies::new(vec![[1.57e6, -10.0], [0.59e6, 7.53]]).unwrap());
    near("least slope, MPa", spring.least_slope(1.0) / 1e6, 2.1, 0.1);
    let viscosity = Viscosity::KumarLopezPamies {
        start: 2.11e6,
        end: 0.1e6,
        thickening: 442e6,
        thinning: 1289.49e-12,
        exponents: [3.0, 1.929],
    };
    let branch = Branch::new(spring, viscosity).unwrap();
    let law = Viscoelastic::new(Box::new(equilibrium), vec![branch]).unwrap();
    for (rate, least, rows) in NITRILE_RUBBER {
        let turn = (1.0 - least) / rate;
        let strain = |t: f64| strain_of_test(Mode::Uniaxial, least + rate * (t - turn).abs());
        let mut times: Vec<f64> = STRETCHES.map(|stretch| (1.0 - stretch) / rate).into();
        times.push(turn);
        times.extend(STRETCHES.iter().rev().map(|stretch| turn + (stretch - least) / rate));
        times.insert(0, 0.0);
        let reaction = Reaction::Test(Mode::Uniaxial);
        let history = History { strain: &strain, temperature: &|_| 293.15, times: &times, reaction };
        let trace = law.follow(&history, law.rest(), Pace::Within(1e3)).unwrap();
        for (index, stretch) in STRETCHES.iter().enumerate() {
            for (name, at, row) in [("load", index, rows[0]), ("unload", 8 - index, rows[1])] {
                let point = &trace.points[at];
                let nominal = nominal_of_test(&strain(point.time), &point.step.prediction.stress) / 1e6;
                near(&format!("{rate} /s, {name} at {stretch}, MPa"), nominal, row[index], 0.03);
            }
        }
    }
}
