//! Example programs: each runs to its end, and some results.

#[path = "../../examples/cooling.rs"]
mod cooling;
#[path = "../../examples/cooling_block.rs"]
mod cooling_block;
#[path = "../../examples/fit_kinetics.rs"]
mod fit_kinetics;
#[path = "../../examples/healing.rs"]
mod healing;
#[path = "../../examples/print_gcode.rs"]
mod print_gcode;
#[path = "../../examples/printed_bar.rs"]
mod printed_bar;
#[path = "../../examples/stress_and_warpage.rs"]
mod stress_and_warpage;

evidence::run_examples!(
    cooling
    cooling_block
    fit_kinetics
    healing
    print_gcode
    printed_bar
    stress_and_warpage
    ; except
);

/// The true constants are recovered.
#[test]
fn kinetics_are_fitted() {
    let fit = fit_kinetics::fitted().unwrap();
    let truth = fit_kinetics::TRUTH;
    for (name, value) in [
        ("growth_rate", truth.growth_rate),
        ("nucleation", truth.nucleation),
        ("avrami_exponent", truth.avrami_exponent),
    ] {
        let found = fit.get(name).unwrap().value;
        assert!((found / value - 1.0).abs() < 1e-4, "{name}: {found}, {value}");
    }
}

#[test]
fn quick_layers_heal_better() {
    let [quick, slow] = [2.0, 50.0].map(|interval| healing::healed(interval).unwrap().unwrap());
    assert!(quick[0] > slow[0] && quick[1] > slow[1] && slow[0] > 0.0, "{quick:?} {slow:?}");
}

/// The release relieves stress and bends the bar, by less than its length.
#[test]
fn a_bar_warps() {
    let [on_bed, released, warpage] = stress_and_warpage::bar().unwrap();
    assert!(on_bed > released && released > 0.0, "{on_bed} {released}");
    assert!(warpage > 1e-7 && warpage < 2e-3, "{warpage}");
}

/// The block cools and crystallizes.
#[test]
fn gcode_is_printed() {
    let top = [5e-3, 3e-3, 0.9e-3];
    let [early, late] = [1.0, 100.0].map(|later| {
        let simulation = print_gcode::printed(later).unwrap();
        (simulation.temperature_at(top).unwrap(), simulation.field_at("alpha", top).unwrap())
    });
    assert!(early.0 > late.0 && late.0 > 353.15 && early.1 < late.1, "{early:?} {late:?}");
}
