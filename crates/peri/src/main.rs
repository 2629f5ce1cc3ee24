//! The `peri` command line.

fn main() -> std::process::ExitCode {
    peri::program::command::main()
}
