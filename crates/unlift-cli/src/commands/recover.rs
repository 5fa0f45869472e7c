//! `unlift recover`: released files in, positions out; no truth needed.

use std::collections::HashSet;

use unlift::audit::Recovery;
use unlift::neighbors::{Listing, Neighborhoods};
use unlift::recover::{Nowhere, RecoverOptions, Solver, Status, recover_kept};
use unlift::released::Released;
use unlift::{About, OneLine, RowOrder, Shelf};
use unlift_io::atomic::{Kind, Rules};
use unlift_io::input::limit;
use unlift_io::shelf::Files;
use unlift_io::stage::{
    Kind as Stage, has_images, read_neighborhoods, read_released, shelve_neighborhoods,
    write_recovered,
};

use super::common::{same_map, this_program, with_threads};
use super::image_stages::recover_all;
use crate::args::RecoverArgs;
use crate::exit::{Outcome, usage};
use crate::output::print;
use crate::progress::Spinner;
use crate::stderr;
use unlift_audit::{Journal, check_file};

/// The lists of a map: in memory, or in files beside the output, where memory is limited and the solver can do with that.
fn open_lists(
    args: &RecoverArgs,
    released: &Released<3>,
) -> anyhow::Result<(Listing, Option<Files>)> {
    let (path, map) = (&args.neighbors, (released.n_records(), released.slots_per_record()));
    let limit = limit().filter(|_| args.solver.reads_shelved());
    let Some(limit) = limit else {
        return Ok((Listing::Here(read_neighborhoods(path, map.0, map.1)?), None));
    };
    let files = Files::beside(&args.out, limit);
    let lists = shelve_neighborhoods(path, map, &files)?;
    Ok((Listing::Away(lists), Some(files)))
}

/// What a user should know about lists that somebody else wrote, which start at these `offsets`.
fn notes(offsets: &[u64], about: About, slots_per_record: usize) -> Vec<String> {
    let mut notes = Vec::new();
    let empty = offsets.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if empty > 0 {
        let n = offsets.len() - 1;
        notes.push(format!(
            "{empty} of {n} lists are empty: solvers that read lists recover nothing there"
        ));
    }
    if about.map.is_none() {
        notes.push("says not which released map it is of: taken to be of this one".to_owned());
    }
    if about.order == RowOrder::Unstated && slots_per_record > 1 {
        let names = RowOrder::STATED.map(|order| order.name().unwrap_or_default()).join(", ");
        notes.push(format!(
            "says not what its rows are counted by (metadata rows_by: {names}): figures of what is recovered \
             will be upper bounds"
        ));
    }
    notes
}

/// Recovers a released map.
pub fn run(args: &RecoverArgs) -> anyhow::Result<Outcome> {
    let rules = Rules::new([args.released.as_path(), &args.neighbors], args.force);
    let kind = Kind::Stage(Stage::Recovered);
    check_file(&args.out, kind, &rules)?;
    let options = RecoverOptions {
        solver: args.solver,
        delta: args.delta,
        seed: args.seed,
        exact_constraints: !args.no_exact_constraints,
        ..RecoverOptions::default()
    };
    if has_images(&args.released)? {
        check_journal(args, "images")?;
        return images(args, &options, &rules);
    }
    if options.solver != Solver::Joint {
        check_journal(args, options.solver.name())?;
    }
    let alive = Spinner::new("recovering");
    let mut journal = journal(args, &alive)?;
    let released = read_released::<3>(&args.released)?;
    let (lists, files) = open_lists(args, &released)?;
    let of = &args.released;
    same_map(&args.neighbors, lists.about().map, of, Some(released.fingerprint()))?;
    for note in notes(lists.offsets(), lists.about(), released.slots_per_record()) {
        alive.say(&format!("unlift: note: {}: {note}", args.neighbors.display()));
    }
    let recovered = with_threads(args.threads, || {
        let shelf = files.as_ref().map(|files| files as &dyn Shelf);
        let recovery = Recovery { released: &released, lists: &lists, options: &options };
        let result = match &mut journal {
            None => recover_kept(&released, (&lists, shelf), &options, &mut Nowhere),
            Some(journal) => {
                let mut kept = journal.rounds(&recovery);
                recover_kept(&released, (&lists, shelf), &options, &mut kept)
            }
        };
        Ok(result.map_err(|error| unlift_io::Error::core(&args.released, error))?)
    })?;
    check_file(&args.out, kind, &rules)?;
    write_recovered(&args.out, &recovered)?;
    journal.into_iter().for_each(Journal::finish);
    drop(alive);
    let n = recovered.status().iter().filter(|&&status| status == Status::Ok).count();
    print(&format!(
        "{n} of {} points have a position, with delta {:.4} {}, in {}\n",
        recovered.n_slots(),
        recovered.delta(),
        recovered.unit().name(),
        OneLine(args.out.display())
    ))?;
    Ok(Outcome::Done)
}

/// Refuses a journal where there are no rounds of a map to keep.
fn check_journal(args: &RecoverArgs, found: &str) -> anyhow::Result<()> {
    match args.journal {
        None => Ok(()),
        Some(_) => Err(usage(format!(
            "--journal keeps rounds of joint recovery: expected a map and --solver joint, found {found}"
        ))),
    }
}

/// Where rounds are kept, if they are to be: by this very program.
fn journal<'a>(args: &RecoverArgs, alive: &'a Spinner) -> anyhow::Result<Option<Journal<'a>>> {
    let Some(folder) = &args.journal else { return Ok(None) };
    Ok(Some(Journal::open(folder, this_program()?, alive)?))
}

/// Recovers released images, one after the other.
fn images(args: &RecoverArgs, options: &RecoverOptions, rules: &Rules) -> anyhow::Result<Outcome> {
    let alive = Spinner::new("recovering");
    // A note says of one image what is so of many.
    let mut told = HashSet::new();
    let note = |lists: &Neighborhoods, slots: usize| {
        for note in notes(lists.offsets(), lists.about(), slots) {
            let what = note.split(|c: char| c.is_ascii_digit()).next_back().unwrap_or_default();
            if told.insert(what.to_owned()) {
                stderr::note(format_args!("{}: {note}", args.neighbors.display()));
            }
        }
    };
    let counts = with_threads(args.threads, || {
        let (files, out) =
            ((args.released.as_path(), args.neighbors.as_path()), args.out.as_path());
        recover_all(files, options, (out, rules), note)
    })?;
    drop(alive);
    print(&format!(
        "{} of {} keypoints of {} images have a position, in {}\n",
        counts.points,
        counts.slots,
        counts.images,
        OneLine(args.out.display())
    ))?;
    Ok(Outcome::Done)
}
