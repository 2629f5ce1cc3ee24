//! Example programs: each runs to its end.

use crate::{linear_solid, rubber_bearing};

#[path = "../../examples/bond_laws.rs"]
mod bond_laws;
#[path = "../../examples/contact.rs"]
mod contact;
#[path = "../../examples/explicit_dynamics.rs"]
mod explicit_dynamics;
#[path = "../../examples/j_integral.rs"]
mod j_integral;
#[path = "../../examples/point_cloud.rs"]
mod point_cloud;
#[path = "../../examples/relax_sheet.rs"]
mod relax_sheet;
#[path = "../../examples/run_scene.rs"]
mod run_scene;
#[path = "../../examples/section_force.rs"]
mod section_force;
#[path = "../../examples/tear_sheet.rs"]
mod tear_sheet;
#[path = "../../examples/write_fields.rs"]
mod write_fields;

evidence::run_examples!(
    bond_laws
    contact
    explicit_dynamics
    j_integral
    linear_solid
    point_cloud
    relax_sheet
    rubber_bearing
    run_scene
    section_force
    tear_sheet
    write_fields
    ; except
);
