//! The program `unlift`.

use std::process::ExitCode;

fn main() -> ExitCode {
    unlift_cli::run(std::env::args_os().collect()).into()
}
