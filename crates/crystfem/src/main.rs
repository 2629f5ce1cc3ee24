//! The `crystfem` command line.

fn main() -> std::process::ExitCode {
    crystfem::command::main()
}
