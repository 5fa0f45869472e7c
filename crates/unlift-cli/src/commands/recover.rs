//! `unlift recover`: recovers points from released files.

use std::collections::HashSet;

use unlift::neighbors::Neighborhoods;
use unlift::recover::{RecoverOptions, Status, recover};
use unlift::{About, OneLine, RowOrder};
use unlift_io::outputs::{Kind, Rules};
use unlift_io::stage::{
    Kind as Stage, has_images, read_neighborhoods, read_released, write_recovered,
};

use super::image_stages::recover_all;
use crate::args::RecoverArgs;
use crate::exit::Outcome;
use crate::output::print;
use crate::progress::Progress;
use crate::stderr;
use unlift_audit::released::same_map;
use unlift_audit::{Progress as _, check_file};

/// Returns notes on lists that another program wrote; `offsets` are the starts of the lists.
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
        notes.push("does not name its released map; assumed to be this one".to_owned());
    }
    if about.order == RowOrder::Unstated && slots_per_record > 1 {
        let names = RowOrder::STATED.map(|order| order.name().unwrap_or_default()).join(", ");
        notes.push(format!(
            "does not state what its rows are counted by (metadata rows_by: {names}): figures of what is recovered \
             will be upper bounds"
        ));
    }
    notes
}

pub fn run(args: &RecoverArgs) -> crate::Result<Outcome> {
    let rules = Rules::new([args.released.as_path(), &args.neighbors], false);
    let kind = Kind::Stage(Stage::Recovered);
    check_file(&args.out, kind, &rules)?;
    let options = RecoverOptions { seed: args.seed, ..RecoverOptions::default() };
    if has_images(&args.released)? {
        return images(args, &options, &rules);
    }
    let alive = Progress::uncounted(false, "recovering");
    let released = read_released::<3>(&args.released)?;
    let map = (released.n_records(), released.slots_per_record());
    let lists = read_neighborhoods(&args.neighbors, map.0, map.1)?;
    let of = &args.released;
    same_map(&args.neighbors, lists.about().map, of, Some(released.fingerprint()))?;
    for note in notes(lists.offsets(), lists.about(), released.slots_per_record()) {
        alive.say(&format!("note: {}: {note}", args.neighbors.display()));
    }
    let recovered = recover(&released, &lists, &args.solver, &options);
    let recovered = recovered.map_err(|error| unlift_io::Error::core(&args.released, error))?;
    check_file(&args.out, kind, &rules)?;
    write_recovered(&args.out, &recovered)?;
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

fn images(args: &RecoverArgs, options: &RecoverOptions, rules: &Rules) -> crate::Result<Outcome> {
    let alive = Progress::uncounted(false, "recovering");
    // The same note about several images is printed once.
    let mut printed = HashSet::new();
    let note = |lists: &Neighborhoods, slots: usize| {
        for note in notes(lists.offsets(), lists.about(), slots) {
            let what = note.split(|c: char| c.is_ascii_digit()).next_back().unwrap_or_default();
            if printed.insert(what.to_owned()) {
                stderr::note(format_args!("{}: {note}", args.neighbors.display()));
            }
        }
    };
    let files = (args.released.as_path(), args.neighbors.as_path());
    let counts = recover_all(files, (args.solver, options), (&args.out, rules), note)?;
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
