//! Whole-program tests: they run the released command lines as a user does, and know nothing of their insides
//! (but [`front_door`], which takes the readers by themselves).
//!
//! * [`bad`]: malformed and absurd scenes, patches in `tests/bad/`, each with the message it must get;
//! * [`commands`]: exit codes, help, closed forms, reports and files;
//! * [`harness`]: functions of all programs: the same commands, and sweeps;
//! * [`bits`]: the same bits on any number of threads;
//! * [`examples`]: the small programs in `crates/*/examples`;
//! * [`killed`]: the same bits after `kill -9`, Ctrl-C and `peri resume`;
//! * [`front_door`]: scenes, meshes, tables, HDF5, laws and checkpoints damaged at random;
//! * [`printing`]: paths that miss the part, gaps, values that are not finite;
//! * [`probes`]: tables along lines and of sections;
//! * [`limits`]: a full disk, memory of the process, one run a folder;
//! * [`loads`]: loads, displacements and names of values in reports;
//! * [`memory`]: no run takes more memory than stated, absurd sizes are refused before they are allocated;
//! * [`meshes`]: bodies from mesh files;
//! * [`packages`]: what each crate is built with;
//! * [`python`]: the Python package;
//! * [`release`]: one version everywhere, the archive;
//! * [`rubber`]: from tests of rubber to a simulated specimen;
//! * [`schemas`]: JSON Schemas, by which every case is valid;
//! * [`view`]: pages in a [`browser`];
//! * [`words`]: mistakes that would pass in silence, and the number of messages;
//! * [`tutorials`]: every command of the tutorials, in their order;
//! * [`documents`]: the commands and links that README and docs show.

mod allocations;
mod bad;
mod bits;
mod browser;
mod chains;
mod commands;
mod documents;
mod examples;
mod front_door;
mod harness;
mod killed;
mod limits;
mod loads;
mod memory;
mod meshes;
mod packages;
mod parts;
mod printing;
mod probes;
mod program;
mod python;
mod release;
mod results;
mod rubber;
mod scenes;
mod schemas;
mod slicers;
mod tutorials;
mod view;
mod words;
