//! The commands.

mod about;
mod audits;
pub mod common;
mod compare;
mod export;
mod features;
mod invert;
mod stages;
mod table;

use common::with_threads;

use crate::args::{AuditCommand, Command};
use crate::demo;

/// Runs one command, and returns false if a gate or a comparison failed.
pub fn run(command: Command) -> crate::Result<bool> {
    let done = match command {
        Command::Audit(AuditCommand::Map(args)) => return audits::map(&args),
        Command::Audit(AuditCommand::Images(args)) => return audits::images(&args),
        Command::Audit(AuditCommand::Released(args)) => return audits::released(&args),
        Command::Audit(AuditCommand::Sequence(args)) => return audits::sequence(&args),
        Command::Audit(AuditCommand::Again(args)) => return audits::again(&args),
        Command::Compare(args) => return compare::run(&args),
        Command::Demo(args) => demo::run(&args),
        Command::Table(args) => table::run(&args),
        Command::Obfuscate(args) => with_threads(|| stages::obfuscate(&args)),
        Command::Neighbors(args) => with_threads(|| stages::neighbors(&args)),
        Command::Recover(args) => with_threads(|| stages::recover(&args)),
        Command::Evaluate(args) => with_threads(|| stages::evaluate(&args)),
        Command::Export(args) => export::run(&args),
        Command::Features(args) => with_threads(|| features::run(&args)),
        Command::Invert(args) => with_threads(|| invert::run(&args)),
        Command::Schemes => about::schemes(),
        Command::Models => about::models(),
    };
    done.map(|()| true)
}
