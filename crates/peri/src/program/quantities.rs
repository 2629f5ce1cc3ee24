//! Scalars of reports of `peri`; [`crate::program::observe::quantities`] lists those of a scene.

harness::quantities! {
    /// Scalars of every variant; with several variants their names end with that of the variant in square
    /// brackets.
    pub OF_A_VARIANT:
    SMALLEST_STRETCH = "smallest_stretch", "", "smallest stretch of an intact bond at the end of any step \
        (with `[dynamics]` in any row of the history)";
    LARGEST_STRETCH = "largest_stretch", "", "largest stretch of an intact bond at the end of any step (with \
        `[dynamics]` in any row of the history)";
    SMALLEST_STRETCH_MET = "smallest_stretch_met", "", "smallest stretch at which the law was evaluated in \
        any iteration";
    LARGEST_STRETCH_MET = "largest_stretch_met", "", "largest stretch at which the law was evaluated in any \
        iteration, broken bonds included";
    FIT_ERROR = "fit_error", "", "measured relative error of the fitted law at the final stretches";
    LARGEST_DISPLACEMENT = "largest_displacement", "m", "length of the longest displacement vector";
    REACTION = "reaction_{axis}", "N", "with a prescribed displacement: the larger of the summed positive \
        and negative reactions of regions along an axis; the history has the signed reaction of each region";
    APPLIED = "applied_{axis}", "N", "with a traction or force: the larger of the applied forces in both \
        directions of an axis";
    PEAK_LOAD = "peak_load", "N", "with two steps or more: largest load";
    DISPLACEMENT_AT_PEAK = "displacement_at_peak", "m", "displacement of the grips at the largest load";
    LOAD_AT = "load_at_{displacement}mm", "N", "with `output.load_at`: load at this displacement, if the run \
        reaches it";
    SECANT_STIFFNESS_AT = "secant_stiffness_at_{displacement}mm", "N/m", "with `output.stiffness_at`: load, \
        less that of rows at displacement 0, over displacement at this one, if the run reaches it and no \
        bonds break in the step around it";
    TANGENT_STIFFNESS_AT = "tangent_stiffness_at_{displacement}mm", "N/m", "with `output.stiffness_at`: \
        slope of the load over the displacement at this one, of second order in the load steps, where \
        there is a secant stiffness";
    LOOP_ENERGY = "loop_energy", "J", "with a `path` or factors of time steps that return: work of the last \
        loop of the load over the displacement, by the trapezoidal rule, between equal displacements, \
        or between equal loads of a run that forces drive; the energy lost in it once the loops repeat";
    WORK_OF_LOADS = "work_of_loads", "J", "work of the loads";
    STORED_ENERGY = "stored_energy", "J", "energy in bonds and contact at the end";
    DAMPED_ENERGY = "damped_energy", "J", "work less stored, released, dissipated and friction energy; in \
        a quasi-static run only as exact as the trapezoidal rule of the work, about 1e-3 of the work, and \
        possibly negative; with `branch` an error of first order in the increments";
    RELEASED_ENERGY = "released_energy", "J", "where bonds break: energy of bonds at the moment they \
        broke";
    DISSIPATED_ENERGY = "dissipated_energy", "J", "with `branch` or `mullins` of a `solid`: energy \
        dissipated in branches, by softening, and by what broken bonds stored beside the energy that drives \
        breaking";
    FIRST_BREAK_TIME = "first_break_time", "s", "with `[time]` or `[dynamics]`: time at the end of the step \
        of the first broken bond";
    LAST_TIME = "last_time", "s", "with `[time]` where bonds break: time at the end of the last step; of a \
        body that tears under a dead load, of its last equilibrium";
    CRITICAL_STRETCH = "critical_stretch", "", "where bonds break: smallest stretch at which a bond \
        of the body breaks";
    CRITICAL_ENERGY = "critical_energy", "J/m³", "with `fracture_energy` of a `solid`: energy over its share \
        of a family above which a bond breaks";
    TEARING_ENERGY = "tearing_energy", "J/m²", "with `material.critical`: energy per area at which a crack \
        runs in equilibrium; for a bond law κB of the critical stretch, for a `solid` its `fracture_energy`";
    NETWORK_MODULUS = "network_modulus", "Pa", "with `material.network`: shear modulus of the network";
    LOCKING_STRETCH = "locking_stretch", "", "with `material.network`: √n of n Kuhn segments between \
        junctions, an estimate of the stretch at which the network locks";
    NEW_CRACK_AREA = "new_crack_area", "m²", "where bonds break: area of new cracks, from pairs of \
        neighbours whose bond broke and that share no neighbour any more";
    DISSIPATED_PER_AREA = "dissipated_per_area", "J/m²", "work less stored, kinetic, friction and \
        `dissipated_energy`, over `new_crack_area`: the energy of new cracks, including losses when bonds \
        snap, at barriers of the lattice, and in bonds that broke elsewhere";
    DISSIPATION_BIAS = "dissipation_bias", "", "`dissipated_per_area` over `tearing_energy`, less 1: 0 if \
        the crack ran at G, positive if the load supplied more";
    FRAGMENTS = "fragments", "", "where bonds break: number of pieces of at least two particles \
        joined by intact bonds";
    LARGEST_FRAGMENT = "largest_fragment", "", "where bonds break: volume of the largest fragment \
        over that of the body";
    BROKEN_ACROSS = "broken_across_{interface}", "", "with `[[interface]]`: share of the bonds across the \
        interface of two parts that are broken or severed";
    FIRST_BREAK = "first_break", "m", "displacement of the grips in the step of the first broken bond";
    LOAD_AT_FIRST_BREAK = "load_at_first_break", "N", "load of the last step before the first broken bond";
    LOAD_OF_FIRST_EVENT = "load_of_first_event", "N", "without `[dynamics]`: load of the equilibrium, within \
        its step, in which the first bonds break";
    BROKEN_BONDS = "broken_bonds", "", "number of broken bonds at the end";
    BREAKING_EVENTS = "breaking_events", "", "with `material.critical`, without `[dynamics]`: number of \
        equilibria in which bonds broke";
    DETACHED_PARTICLES = "detached_particles", "", "number of particles without any bond at the end";
    LAST_LOAD = "last_load", "N", "load of the last step";
    LAST_DISPLACEMENT = "last_displacement", "m", "displacement of the grips in the last step";
    CONTACT_ENERGY = "contact_energy", "J", "with `[contact]`: energy of pairs, planes and elastic slip, \
        part of `stored_energy`";
    CONTACTS = "contacts", "", "with `[contact]`: number of touching pairs of particles, and of faces and \
        planes, at the end";
    DEEPEST_OVERLAP = "deepest_overlap", "", "with `[contact]`: largest overlap at the end of any step: 1 − \
        r/d of a pair of particles, depth of a face behind a plane over half a spacing";
    CONTACT_SHARE = "contact_share", "", "with `[contact]`: energy of contact over the stored energy at the \
        end; the load is too low by about this fraction";
    CONTACT_STIFFNESS = "contact_stiffness", "", "with `[contact]`: stiffness s of the first plane, else of \
        the first indenter, else of pairs of particles; κ with `short_range`";
    FRICTION_WORK = "friction_work", "J", "with `friction`: energy dissipated by friction";
    PLANE_FORCE = "{plane}_force_{axis}", "N", "force of a rigid plane or an indenter on the body along an \
        axis at the end";
    PLANE_AREA = "{plane}_area", "m²", "undeformed area of the faces of the body that touch a rigid plane or \
        an indenter at the end";
    PLANE_WIDTH = "{plane}_width", "m", "largest extent along a rigid plane, or across the force of an \
        indenter, of the faces that touch it at the end; in a plane body the width of contact";
    PLANE_SPREAD = "{plane}_spread", "m", "root mean square distance from the centre of pressure on a rigid \
        plane or an indenter at the end, weighted by pressure; half the half-width of a Hertzian strip, \
        0.632 of the radius of a Hertzian circle";
    PLANE_PRESSURE = "{plane}_pressure", "Pa", "greatest pressure of a rigid plane or an indenter on a face \
        at the end: force along the normal over the present area; 0 where nothing is pressed";
    PAIR_PRESSURE = "contact_pressure", "Pa", "greatest pressure of particles on another that they touch, at \
        the end, over its share of the undeformed surface";
    INDENTER_DISPLACEMENT = "{indenter}_displacement_{axis}", "m", "displacement of an indenter at the end; \
        with a force from where it first touches the body at rest";
    INDENTER_VELOCITY = "{indenter}_velocity_{axis}", "m/s", "velocity of an indenter with a mass at the end";
    CRITICAL_TIME_STEP = "critical_time_step", "s", "critical time step 2/ω of the body at the start";
    TIME_STEP = "time_step", "s", "time step at the end";
    KINETIC_ENERGY = "kinetic_energy", "J", "kinetic energy at the end";
    ENERGY_ERROR = "energy_error", "", "largest error of the energy balance, over the largest work or \
        kinetic energy";
    MIXED_ERROR = "mixed_error", "", "with `precision = \"mixed\"`: relative rms difference from forces in \
        double precision at the end; 0 if the law needs double precision there";
    FORCE_IMBALANCE = "force_imbalance", "", "without `[dynamics]`: largest sum of the internal forces in \
        any step, over half the sum of their magnitudes; zero up to rounding at any residual";
    MOMENT_IMBALANCE = "moment_imbalance", "", "without `[dynamics]`: largest sum of the moments of internal \
        forces about the middle of the deformed body, over half the sum of their magnitudes and half the \
        diagonal";
    REACTION_IMBALANCE = "reaction_imbalance", "", "without `[dynamics]`: largest sum of reactions and \
        loads, over half the sum of magnitudes of internal forces: the residual of free particles";
    LARGEST_RESIDUAL = "largest_residual", "", "largest residual of any step";
    OUTSIDE_SHARE = "outside_share", "", "of a learnt law: share of particles outside the box of its \
        training data at the end";
    FLAGGED_SHARE = "flagged_share", "", "of a learnt law: share of uncertain particles at the end: outside \
        the box, in a gap of the data, or with a spread of members";
    FIRST_STEP_OUTSIDE = "first_step_outside", "", "of a learnt law: first load step (with `[dynamics]` row \
        of the history) in which a particle leaves the box of its training data";
    FAILED_AS_EXPECTED = "failed_as_expected", "", "1 if a variant with `expect_error` ended with this \
        error, else 0";
    PROBE = "{probe}", "*", "value of a probe at the end (m, rad, J/m² or a strain)";
    PROBE_PEAK = "{probe}_peak", "*", "value of a probe with the largest magnitude; of a rotation up to the \
        end of its first half swing";
    PROBE_FREQUENCY = "{probe}_frequency", "rad/s", "of a rotation: π over the time of the zero at the end \
        of its first half swing";
    PROBE_RATE = "{probe}_rate", "rad/s", "of a rotation: frequency times peak, the initial rate of a \
        harmonic swing of this peak";
    PROBE_SPEED = "{probe}_speed", "m/s", "of a crack or a front: mean speed between its gauges if a row \
        lies before the first; without gauges between its first and last row";
    PROBE_ARRIVAL = "{probe}_arrival", "s", "of a crack or a front with gauges: time of the first row of the \
        history with it at or beyond the first";
    PROBE_BETWEEN_GAUGES = "{probe}_between_gauges", "", "number of rows of the history with the tip or \
        front between the gauges";
    PROBE_BACKSTEP = "{probe}_backstep", "m", "of a crack or a front: largest backward step between the \
        gauges";
    PROBE_ACROSS = "{probe}_across", "m", "of a crack: largest distance of its tip from 0 across its axis, \
        between the gauges if there are any";
    PROBE_TEARING_ENERGY = "{probe}_tearing_energy", "J/m²", "of a crack with one tip in the plane: work \
        less stored, kinetic, dissipated, damped and friction energy since it starts, over its advance times \
        the thickness";
    PROBE_LOAD_AT = "{probe}_load_at_{opening}mm", "N", "of an opening: load at this value, if the run \
        reaches it";
    MEAN_STRESS = "mean_stress_{component}", "Pa", "with `[periodic]`: mean first Piola–Kirchhoff stress of \
        the cell at the end, voids included; where no particle is held or loaded, the force along the first \
        axis over the area at rest across the second";
    SECTION_FORCE = "{section}_force_{axis}", "N", "force along an axis that bonds across a section exert on \
        the part of the body behind it at the end";
    SECTION_MOMENT = "{section}_moment_{axis}", "N m", "moment of the forces across a section about its \
        point at the end";
    KIRSCH_FIRST = "kirsch_first", "", "σ₁₁/σ∞ of Kirsch's plate at the particles nearest to the hole";
    EXACT_FIRST = "exact_first", "", "of `plate-with-hole`: exact σ₁₁/σ∞ at the particles nearest to the \
        hole";
    EXACT_PEAK = "exact_peak", "", "of `plate-with-hole`: exact σ₁₁/σ∞ at the rim of the hole";
    MEASURE_MAX = "{measure}_max", "", "largest σ₁₁/σ∞ of all particles without loads and supports";
    MEASURE_FIRST = "{measure}_first", "", "computed σ₁₁/σ∞ at the particles nearest to the hole";
    MEASURE_PEAK = "{measure}_peak", "", "largest σ₁₁/σ∞ above the hole";
    MEASURE_PEAK_ERROR = "{measure}_peak_error", "", "`MEASURE_peak` over the exact value at the particles \
        nearest to the hole, less 1";
    MEASURE_ERROR = "{measure}_{error}", "", "error (2.84) of σ₁₁/σ∞: `rmse` over all particles, \
        `rmse_inner` without particles with loads or supports; of `plate-with-hole` also `rmse_ring` up to \
        2δ from the hole, `rmse_bulk` from there to five radii, and `rmse_kirsch`, `rmse_inner_kirsch` \
        against Kirsch's solution";
}

harness::quantities! {
    /// Scalars of a variant for each parameter that follows a field of another scene (`[[material.fields]]`).
    pub OF_A_FIELD:
    FIELD_MEAN = "{parameter}_field_mean", "*", "mean over the particles, weighted by volume, of the field \
        that the parameter follows";
    FIELD_MESH_MEAN = "{parameter}_field_mesh_mean", "*", "mean over its mesh of the field that the \
        parameter follows";
    FIELD_LEAST = "{parameter}_field_least", "*", "smallest value in a particle of the field that the \
        parameter follows";
    FIELD_LARGEST = "{parameter}_field_largest", "*", "largest value in a particle of the field that the \
        parameter follows";
}

harness::quantities! {
    /// Scalars of a whole scene.
    pub OF_A_SCENE:
    KT_FINITE_WIDTH = "kt_finite_width", "", "peak σ₁₁/σ∞ of a long strip of the plate's width, by Heywood";
    MEASURE_ORDER = "{measure}_{error}_order[{variants}]", "", "observed order of an error over the spacing";
    PEAK_LOAD_CHANGE = "peak_load_change[{variants}]", "", "relative change of the peak load between the two \
        finest spacings";
    COMPARED = "{quantity}_error[{variant}]", "", "with `output.compare`: |q/q₀ − 1|";
    SAME_EVENTS = "same_events[{variant}]", "", "with `output.compare`: number of first events that broke \
        the same bonds in the same load step as the reference";
    INTEGRAL_DISK_1111 = "integral_disk_1111", "", "∫ ξ₁⁴/|ξ|³ dV over the unit disk, see Appendix A";
    INTEGRAL_DISK_1122 = "integral_disk_1122", "", "∫ ξ₁²ξ₂²/|ξ|³ dV over the unit disk";
    INTEGRAL_BALL_1111 = "integral_ball_1111", "", "∫ ξ₁⁴/|ξ|³ dV over the unit ball";
    INTEGRAL_BALL_1122 = "integral_ball_1122", "", "∫ ξ₁²ξ₂²/|ξ|³ dV over the unit ball";
    DOUBLE_INTEGRAL_DISK_TRACE = "double_integral_disk_trace", "", "∬ |ξ| dV dV over the unit disk";
    DOUBLE_INTEGRAL_BALL_TRACE = "double_integral_ball_trace", "", "∬ |ξ| dV dV over the unit ball";
    PRINTED_OVER_DISK = "printed_over_double_integral_disk", "", "trace of (A.18) as published over the \
        integral";
    PRINTED_OVER_BALL = "printed_over_double_integral_ball", "", "trace of (A.38) as published over the \
        integral";
}

use harness::report::{Named, Quantity};

/// Imbalances of the whole body, see [`crate::solver::Balance`]; of several variants the report also has the
/// largest.
pub const BALANCES: [Quantity; 3] = [FORCE_IMBALANCE, MOMENT_IMBALANCE, REACTION_IMBALANCE];

/// Scalars of [`crate::integrals::all`], in its order.
pub const INTEGRALS: [Quantity; 8] = [
    INTEGRAL_DISK_1111,
    INTEGRAL_DISK_1122,
    INTEGRAL_BALL_1111,
    INTEGRAL_BALL_1122,
    DOUBLE_INTEGRAL_DISK_TRACE,
    DOUBLE_INTEGRAL_BALL_TRACE,
    PRINTED_OVER_DISK,
    PRINTED_OVER_BALL,
];

/// Names the load at a displacement, m.
pub fn load_at(displacement: f64) -> Named {
    LOAD_AT.named(&[&millimetres(displacement)])
}

/// Names the secant and the tangent stiffness at a displacement, m.
pub fn stiffness_at(displacement: f64) -> [Named; 2] {
    [SECANT_STIFFNESS_AT, TANGENT_STIFFNESS_AT].map(|one| one.named(&[&millimetres(displacement)]))
}

/// Names the load at an opening, m, of a probe.
pub fn probe_load_at(probe: &str, opening: f64) -> Named {
    PROBE_LOAD_AT.named(&[probe, &millimetres(opening)])
}

fn millimetres(length: f64) -> String {
    ((length * 1e9).round() / 1e6).to_string()
}

/// All scalars.
pub const ALL: &[&[Quantity]] = &[OF_A_VARIANT, OF_A_FIELD, OF_A_SCENE, harness::study::OF_STUDIES];
