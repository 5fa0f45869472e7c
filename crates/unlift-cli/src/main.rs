//! The command line of unlift: parse, call the library, print.

mod args;
mod commands;
mod exit;
mod interrupt;
mod output;
mod pace;
mod progress;
mod values;

use std::process::ExitCode;

fn main() -> ExitCode {
    // Usage errors end here, with exit code 2.
    let cli = args::Cli::read(std::env::args_os()).unwrap_or_else(|error| error.exit());
    interrupt::watch();
    exit::finish(commands::run(cli.command))
}
