//! `unlift paper`: reproduces the paper's tables on its datasets.

use std::num::NonZeroUsize;

use unlift::OneLine;
use unlift_audit::paper::{FIGURES, Part, Reproduction, Request, reproduce};
use unlift_io::Error;

use super::common::with_threads;
use crate::args::PaperArgs;
use crate::exit::Outcome;
use crate::output::{command_line, print, table};
use crate::progress::Progress;
use crate::stderr;

pub fn run(args: &PaperArgs) -> anyhow::Result<Outcome> {
    let parts = if args.parts.is_empty() { &Part::ALL[..] } else { &args.parts };
    let found = with_threads(args.threads, || {
        Ok(reproduce(&Request {
            dataset: args.dataset,
            root: &args.path,
            models: args.models.as_deref(),
            scale: args.scale,
            scenes: args.scenes.clone(),
            parts: parts.to_vec(),
            images: args.images.get(),
            max_points: args.max_points.map(NonZeroUsize::get),
            seed: args.seed,
            out: &args.out,
            force: args.force,
            command: Some(command_line()),
            begin: &|| Box::new(Progress::new(args.quiet)),
        })?)
    })?;
    if found.pages.is_empty() {
        found.missing.iter().for_each(|line| stderr::note(format_args!("missing: {line}")));
    } else {
        print(&if args.json { format!("{:#}\n", found.json()) } else { text(args, &found) })?;
    }
    let expected = match (found.pages.is_empty(), found.failed.len()) {
        (false, 0) => return Ok(Outcome::Done),
        (true, 0) => "photos of a test split, or a map of a scene in meters",
        _ => "scenes that can be audited, with photos that can be used",
    };
    let failed = match found.failed.len() {
        0 => "none".to_owned(),
        n => format!("{n} failed, as told above"),
    };
    Err(Error::new(&args.path, "", expected, failed).into())
}

/// Formats the tables, missing data and the paths of the results.
fn text(args: &PaperArgs, found: &Reproduction) -> String {
    let mut text = String::new();
    for sheet in found.sheets() {
        text.push_str(&format!("{}\n{}\n", OneLine(&sheet.title), table(&sheet.rows, &[])));
    }
    for line in &found.missing {
        text.push_str(&format!("missing: {}\n", OneLine(line)));
    }
    for line in &found.elsewhere {
        text.push_str(&format!("not here: {line}\n"));
    }
    for line in &found.failed {
        text.push_str(&format!("failed: {}\n", OneLine(line)));
    }
    let figures = args.out.join(FIGURES);
    text.push_str(&format!(
        "\nfigures: {}; pages of {} audits below {}\n",
        OneLine(figures.display()),
        found.pages.len(),
        OneLine(args.out.display())
    ));
    text
}
