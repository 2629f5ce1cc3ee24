//! Shared ground of the polymer-mechanics toolkit: tensors, Langevin statistics, hyperelastic laws,
//! units, scenes, reports and output.

