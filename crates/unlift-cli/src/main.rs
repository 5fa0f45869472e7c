//! The command line of unlift: parse, call the library, print.

mod args;
mod commands;
mod exit;
mod gate;
mod memory;
mod output;
mod prepare;
mod progress;
mod values;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    // Usage errors end here, with exit code 2.
    let cli = args::Cli::parse();
    exit::finish(commands::run(cli.command))
}
