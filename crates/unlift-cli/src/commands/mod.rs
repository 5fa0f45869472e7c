//! The commands, one file each.

mod about;
mod audit_again;
mod audit_images;
mod audit_map;
mod audit_released;
mod audit_sequence;
pub mod audits;
pub mod common;
mod compare;
mod evaluate;
mod export;
mod features;
mod image_stages;
mod invert;
mod neighbors;
mod obfuscate;
mod recover;
mod table;

use common::with_threads;

use crate::args::{AuditCommand, Command};
use crate::demo;
use crate::exit::Outcome;

/// Runs one command.
///
/// # Errors
/// If the command cannot complete; `exit` turns the error into a line and an exit code.
pub fn run(command: Command) -> crate::Result<Outcome> {
    match command {
        Command::Demo(args) => demo::run(&args),
        Command::Audit(AuditCommand::Map(args)) => audit_map::run(&args),
        Command::Audit(AuditCommand::Images(args)) => audit_images::run(&args),
        Command::Audit(AuditCommand::Released(args)) => audit_released::run(&args),
        Command::Audit(AuditCommand::Sequence(args)) => audit_sequence::run(&args),
        Command::Audit(AuditCommand::Again(args)) => audit_again::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Table(args) => table::run(&args),
        Command::Obfuscate(args) => with_threads(|| obfuscate::run(&args)),
        Command::Neighbors(args) => with_threads(|| neighbors::run(&args)),
        Command::Recover(args) => with_threads(|| recover::run(&args)),
        Command::Evaluate(args) => with_threads(|| evaluate::run(&args)),
        Command::Export(args) => export::run(&args),
        Command::Features(args) => with_threads(|| features::run(&args)),
        Command::Invert(args) => with_threads(|| invert::run(&args)),
        Command::Schemes => about::schemes(),
        Command::Models => about::models(),
    }
}
