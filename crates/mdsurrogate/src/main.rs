//! Command line of `mdsurrogate`.

fn main() -> std::process::ExitCode {
    mdsurrogate::program::command::main()
}
