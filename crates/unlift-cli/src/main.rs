//! The command line of unlift: parses arguments, calls the library, prints results.

mod args;
mod commands;
mod exit;
mod interrupt;
mod output;
mod pace;
mod progress;
mod stderr;
mod values;

use std::process::ExitCode;

fn main() -> ExitCode {
    interrupt::watch();
    match args::Cli::read(std::env::args_os()) {
        Ok(cli) => {
            if let Some(bytes) = cli.memory_limit {
                unlift_io::input::limit_memory(bytes);
            }
            exit::finish(commands::run(cli.command))
        }
        Err(told) => exit::told(told),
    }
}
