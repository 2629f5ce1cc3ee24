//! Whole-program tests of the command lines.
