//! The `mdsurrogate` command line.

fn main() -> std::process::ExitCode {
    mdsurrogate::program::command::main()
}
