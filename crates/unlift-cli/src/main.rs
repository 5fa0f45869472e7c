//! The program `unlift`.

use std::process::ExitCode;

#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    unlift_cli::run(std::env::args_os().collect()).into()
}
