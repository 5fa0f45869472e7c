//! The command line of unlift: parse, call the library, print.

mod args;
mod args_audit;
mod args_bench;
mod args_features;
mod args_images;
mod args_released;
mod clouds;
mod commands;
mod document;
mod exit;
mod gate;
mod images;
mod interrupt;
mod job;
mod lengths;
mod memory;
mod output;
mod outputs;
mod pace;
mod pictures;
mod prepare;
mod progress;
mod values;

use std::process::ExitCode;

fn main() -> ExitCode {
    // Usage errors end here, with exit code 2.
    let cli = args::Cli::read(std::env::args_os()).unwrap_or_else(|error| error.exit());
    interrupt::watch();
    exit::finish(commands::run(cli.command))
}
