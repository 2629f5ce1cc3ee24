//! The program `peri`.

fn main() -> std::process::ExitCode {
    peri::program::command::main()
}
