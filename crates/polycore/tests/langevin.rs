//! `polycore::langevin` against values computed with mpmath at 60 digits (`tools/langevin.py reference`).

use std::collections::BTreeMap;

use polycore::langevin;

type ScalarFunction = fn(f64) -> f64;

/// Difference in units of the last place of the reference.
fn ulps(value: f64, reference: f64) -> f64 {
    let place = reference.abs().next_up() - reference.abs();
    (value - reference).abs() / place
}

#[test]
fn every_function_within_its_documented_error() {
    // in ulp: the table in the documentation of `polycore::langevin`; the tabulated reference is itself
    // rounded (1/2)
    let functions: [(&str, ScalarFunction, f64); 8] = [
        ("langevin", langevin::langevin, 4.0),
        ("derivative", langevin::derivative, 4.0),
        ("complement", langevin::complement, 2.0),
        ("ln_beta_over_sinh", langevin::ln_beta_over_sinh, 4.0),
        ("free_energy", langevin::free_energy, 10.0),
        ("inverse", langevin::inverse, 2.0),
        ("inverse_from_complement", langevin::inverse_from_complement, 2.0),
        ("inverse_derivative", langevin::inverse_derivative, 5.0),
    ];
    let mut worst = BTreeMap::new();
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_reader(&include_bytes!("langevin_reference.csv")[..]);
    for row in reader.deserialize() {
        let (name, argument, reference): (String, f64, f64) = row.expect("function,argument,value");
        let (_, function, _) = functions.iter().find(|(known, ..)| *known == name).expect("a known function");
        let error = ulps(function(argument), reference);
        let entry = worst.entry(name).or_insert((0.0, 0.0, 0usize));
        entry.2 += 1;
        if error > entry.0 || error.is_nan() {
            (entry.0, entry.1) = (error, argument);
        }
    }
    println!("function: (max error in ulp, where, points) {worst:#?}");
    for (name, _, allowed) in functions {
        let (error, argument, points) = worst[name];
        assert!(error <= allowed, "{name}({argument:e}) is {error} ulp off");
        assert!(points >= 80, "{name} has {points} reference values only");
    }
}
