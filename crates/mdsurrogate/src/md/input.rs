//! Input files of LAMMPS, complete and readable, so that runs can be repeated by hand.
//!
//! ReaxFF with charge equilibration. The control file tabulates the long-range terms and limits the bond list
//! to 3 Å (uncorrected C/H/O/N bond orders beyond are below 1e-4), which is 1.5 times as fast as the defaults
//! for 9,472 atoms.

use super::{AXES, MdRun, Protocol};
use std::fmt::Write;

/// Force-field file in a folder.
pub const FORCE_FIELD: &str = "in/ffield.reax";

/// ReaxFF control file.
pub const CONTROL: &str = "\
tabulate_long_range     2500 ! points of the splines of van der Waals and Coulomb terms
nbrhood_cutoff          3.0
hbond_cutoff            7.5
bond_graph_cutoff       0.3
thb_cutoff              0.001
";

/// Python driver that runs an input through the LAMMPS module.
pub const DRIVER: &str = "\
# python3 driver.py INPUT [LAMMPS options]: what `lmp -in INPUT [options]` does
import sys
from lammps import lammps

engine = lammps(cmdargs=sys.argv[2:])
engine.file(sys.argv[1])
engine.close()
";

fn head(data: &str) -> String {
    format!(
        "units           real
atom_style      charge
boundary        p p p
box             tilt large
read_data       {data}
"
    )
}

fn field(skin: &str) -> String {
    format!(
        "pair_style      reaxff in/control.reax safezone 2.0 mincap 200 minhbonds 300
pair_coeff      * * {FORCE_FIELD} C H O N
fix             charges all qeq/reaxff 1 0.0 10.0 1e-6 reaxff
neighbor        1.0 bin
neigh_modify    every {skin} delay 0 check yes
"
    )
}

/// Returns the relaxation at 0 K, `data` → `out`: conjugate gradients, then the three edges at 1 atm.
pub fn relax(protocol: &Protocol, data: &str, out: &str) -> String {
    head(data)
        + &field("1")
        + &format!(
            "thermo          50
thermo_style    custom step pe press pxx pyy pzz lx ly lz density
min_style       cg
minimize        1e-9 1e-2 {n} {evaluations}
fix             edges all box/relax aniso 1.0 vmax 0.002
minimize        1e-9 1e-2 {n} {evaluations}
unfix           edges
write_data      {out} nocoeff
",
            n = protocol.relaxation,
            evaluations = 3 * protocol.relaxation
        )
}

/// Returns the equilibration, `data` → `out`: velocities, NVT, NPT with three independent edges at 1 atm;
/// mean lengths in `lengths`.
pub fn equilibrate(protocol: &Protocol, cells: [usize; 3], data: &str, out: &str, lengths: &str) -> String {
    let Protocol { time_step, temperature: t, warm_up, equilibration, seed, .. } = protocol;
    let (thermostat, barostat) = (100.0 * time_step, 1000.0 * time_step);
    let half = equilibration / 2;
    head(data)
        + &format!("replicate       {} {} {}\n", cells[0], cells[1], cells[2])
        + &field("5")
        + &format!(
            "timestep        {time_step}
thermo          100
thermo_style    custom step temp pe press pxx pyy pzz lx ly lz density
reset_timestep  0
velocity        all create {t} {seed} dist gaussian
velocity        all zero linear
fix             bath all nvt temp {t} {t} {thermostat}
run             {warm_up}
unfix           bath
fix             bath all npt temp {t} {t} {thermostat} x 1 1 {barostat} y 1 1 {barostat} z 1 1 {barostat}
run             {first}
reset_timestep  0
variable        lx equal lx
variable        ly equal ly
variable        lz equal lz
fix             mean all ave/time 1 {half} {half} v_lx v_ly v_lz file {lengths} format \" %.10g\"
run             {half}
write_data      {out} nocoeff
",
            first = equilibration - half
        )
}

/// Returns the start configurations `out`_1.data, `out`_2.data, …: box at the reference lengths, NVT.
pub fn snapshots(protocol: &Protocol, lengths: [f64; 3], data: &str, out: &str) -> String {
    let Protocol { time_step, temperature: t, settling, snapshots, gap, .. } = protocol;
    let [x, y, z] = lengths;
    head(data)
        + &field("5")
        + &format!(
            "timestep        {time_step}
reset_timestep  0
change_box      all x final 0.0 {x:?} y final 0.0 {y:?} z final 0.0 {z:?} remap units box
thermo          100
thermo_style    custom step temp pe press pxx pyy pzz lx ly lz density
fix             bath all nvt temp {t} {t} {thermostat}
run             {settling}
label           again
variable        k loop {snapshots}
run             {gap}
write_data      {out}_$k.data nocoeff
next            k
jump            SELF again
",
            thermostat = 100.0 * time_step
        )
}

/// Returns a deformation run from `data`: instantaneous values in `out`.inst, interval means in `out`.mean.
///
/// Each edge with a rate follows l = L₀(1 + rate·t), each tilt xy = ly₀·rate·t; every other edge has its own
/// barostat. With [`Protocol::stepwise`] the strains are equal at the end of each interval, and means cover
/// its last part.
pub fn deform(protocol: &Protocol, run: &MdRun, data: &str, out: &str) -> String {
    let Protocol { time_step, temperature: t, steps, every, .. } = protocol;
    let (thermostat, barostat) = (100.0 * time_step, 1000.0 * time_step);
    let sheared = run.rates[3..].iter().any(Option::is_some);
    let mut bath = String::new();
    for axis in (0..3).filter(|&axis| run.rates[axis].is_none()) {
        let _ = write!(bath, " {} 1 1 {barostat}", AXES[axis]);
    }
    let ensemble = if bath.is_empty() { "nvt" } else { "npt" };
    if sheared && !bath.is_empty() {
        // `fix deform` controls the tilts
        bath.push_str(" scalexy no scalexz no scaleyz no");
    }
    let bath = format!("fix             bath all {ensemble} temp {t} {t} {thermostat}{bath}\n");
    // a flip of the box would be a jump of F
    let flip = if sheared { " flip no" } else { "" };
    let mut values = String::from("c_thermo_temp v_pe");
    for name in ["lx", "ly", "lz", "xy", "xz", "yz"] {
        let _ = write!(values, " v_{name}");
    }
    for index in 1..=6 {
        let _ = write!(values, " c_thermo_press[{index}]");
    }
    let variables: String = ["pe", "lx", "ly", "lz", "xy", "xz", "yz"]
        .iter()
        .map(|name| format!("variable        {name} equal {name}\n"))
        .collect();
    let averaged = protocol.stepwise.map_or(*every, |step| every - step.pull - step.relax);
    let redrawn = run.seed.map_or_else(String::new, |seed| {
        format!(
            "velocity        all create {t} {seed} dist gaussian
velocity        all zero linear
fix             bath all nvt temp {t} {t} {thermostat}
run             {}
unfix           bath
",
            protocol.warm_up
        )
    });
    let samples = format!(
        "fix             now all ave/time 1 1 {every} {values} file {out}.inst format \" %.10g\"
fix             mean all ave/time 1 {averaged} {every} {values} file {out}.mean format \" %.10g\"
"
    );
    let pulled: Vec<(usize, f64)> =
        run.rates.iter().enumerate().filter_map(|(axis, rate)| Some((axis, (*rate)?))).collect();
    let loading = match protocol.stepwise {
        None => {
            let mut pull = String::new();
            for (axis, rate) in &pulled {
                let _ = write!(pull, " {} erate {rate:e}", AXES[*axis]);
            }
            let (turn, back) = unloading(protocol, run, &pulled);
            format!(
                "{turn}fix             pull all deform 1{pull} remap x units box{flip}
{bath}{samples}run             {loading}
{back}",
                loading = loading_steps(protocol, run),
                turn = turn,
                back = back.replace("FLIP", flip),
            )
        }
        Some(step) => {
            let interval = *every as f64 * time_step;
            // the tilts xy, xz, yz scale with the box length of their second letter
            let edges = ["ly", "lz", "lz"];
            let (mut first, mut each, mut pull) = (String::new(), String::new(), String::new());
            for (axis, rate) in &pulled {
                let (name, part) = (AXES[*axis], rate * interval);
                if *axis < 3 {
                    // l(k)/l(k − 1)
                    let factor = format!("(1+{part:e}*v_k)/(1+{part:e}*(v_k-1))");
                    let _ = writeln!(each, "variable        f{name} equal {factor}");
                    let _ = write!(pull, " {name} scale ${{f{name}}}");
                } else {
                    let edge = edges[*axis - 3];
                    let _ = writeln!(first, "variable        d{name} equal $({edge})*{part:e}");
                    let _ = write!(pull, " {name} delta ${{d{name}}}");
                }
            }
            format!(
                "{first}{samples}label           again
variable        k loop {intervals}
{each}fix             pull all deform 1{pull} remap x units box{flip}
{bath}run             {stretching}
unfix           pull
unfix           bath
fix             bath all nvt temp {t} {t} {thermostat}
run             {held}
unfix           bath
next            k
jump            SELF again
",
                intervals = steps / every,
                stretching = step.pull,
                held = every - step.pull,
            )
        }
    };
    head(data)
        + if sheared { "change_box      all triclinic\n" } else { "" }
        + &field("5")
        + &format!(
            "timestep        {time_step}
{redrawn}reset_timestep  0
{variables}thermo          {every}
thermo_style    custom step temp pe press pxx pyy pzz pxy pxz pyz lx ly lz xy xz yz
{loading}"
        )
}

/// Returns the steps before the rates are reversed, in whole intervals of samples.
fn loading_steps(protocol: &Protocol, run: &MdRun) -> u64 {
    let intervals = protocol.steps / protocol.every;
    let share = run.unload.unwrap_or(1.0);
    protocol.every * ((share * intervals as f64).round() as u64).clamp(1, intervals)
}

/// Returns the lines before the first pull and after it that reverse the rates of the initial lengths;
/// `erate` would refer to the lengths at the reversal.
fn unloading(protocol: &Protocol, run: &MdRun, pulled: &[(usize, f64)]) -> (String, String) {
    let left = protocol.steps - loading_steps(protocol, run);
    if run.unload.is_none() || left == 0 {
        return Default::default();
    }
    // a tilt scales with the edge of its second letter
    let edges = ["lx", "ly", "lz", "ly", "lz", "lz"];
    let (mut first, mut back) = (String::new(), String::new());
    for &(axis, rate) in pulled {
        let name = AXES[axis];
        let _ = writeln!(first, "variable        v{name} equal $({})*{:e}", edges[axis], -rate);
        let _ = write!(back, " {name} vel ${{v{name}}}");
    }
    (
        first,
        format!(
            "unfix           pull\n\
             fix             pull all deform 1{back} remap x units boxFLIP\n\
             run             {left}\n"
        ),
    )
}
