//! The `crystfem` command line.

fn main() -> std::process::ExitCode {
    crystfem::program::command::main()
}
