//! `unlift obfuscate`: hides a map or features of images; writes a released file and a truth file.

use unlift::obfuscate::{SchemeOptions, obfuscate};
use unlift::seed::Key;
use unlift::{OneLine, Unit};
use unlift_io::atomic::Access;
use unlift_io::outputs::{Kind, OutputSet, Rules};
use unlift_io::stage::{Kind as Stage, write_released, write_truth};

use super::common::{RELEASED, TRUTH, all_could_be, open_map};
use super::image_stages::hide;
use crate::args::ObfuscateArgs;
use crate::exit::{Outcome, usage};
use crate::output::print;
use crate::progress::Stderr;
use crate::stderr;
use unlift_audit::{Progress as _, refused};

const GUESSABLE: &str = "unlift: note: whoever guesses the --seed can restore the order of the records and, under cp, \
    the points: do not release this map";

pub fn run(args: &ObfuscateArgs) -> crate::Result<Outcome> {
    let inputs = [args.path.as_path()].into_iter().chain(args.map.descriptors.as_deref());
    let files = [(RELEASED, Kind::Stage(Stage::Released)), (TRUTH, Kind::Stage(Stage::Truth))];
    let rules = Rules::new(inputs, false);
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &files).map_err(refused)?;
    let name = args.scheme.name;
    let unit = if args.map.scale.is_some() { Unit::Meter } else { Unit::KthNeighbor };
    let Some(scheme) = args.scheme.of_dimension::<3>(&SchemeOptions::usual(unit)) else {
        return images(args, out);
    };
    let prepared = open_map(&args.path, &args.map, false, (args.seed.unwrap_or(0), false))?;
    for note in prepared.doubts.iter().chain(&prepared.notes) {
        Stderr.say(&format!("note: {note}"));
    }
    let descriptors = prepared.descriptors.as_ref();
    let key = key(args)?;
    let hidden = obfuscate(&*scheme, &prepared.original, descriptors, &key);
    let (released, secret) = hidden.map_err(|e| unlift_io::Error::core(&args.path, e))?;
    write_truth(&out.stage(TRUTH, Kind::Stage(Stage::Truth))?, &prepared.original, &secret)?;
    write_released(&out.stage(RELEASED, Kind::Stage(Stage::Released))?, &released)?;
    out.commit()?;
    print(&format!(
        "{name}: {} points hidden in {} records, {} dropped, in {}\n",
        released.n_slots(),
        released.n_records(),
        secret.dropped().len(),
        OneLine(args.out.display())
    ))?;
    Ok(Outcome::Done)
}

/// Returns the key that all randomness comes from.
fn key(args: &ObfuscateArgs) -> crate::Result<Key> {
    Ok(match args.seed {
        Some(seed) => {
            stderr::tell(GUESSABLE);
            Key::from_seed(seed)
        }
        None => Key::fresh()?,
    })
}

/// Hides the keypoints of many images, each under a key of its own.
fn images(args: &ObfuscateArgs, mut out: OutputSet) -> crate::Result<Outcome> {
    let map = &args.map;
    for (option, given) in [
        ("--scale", map.scale.is_some()),
        ("--descriptors", map.descriptors.is_some()),
        ("--max-points", map.max_points.is_some()),
    ] {
        if given {
            let name = args.scheme.name;
            return Err(usage(format!(
                "{option}: expected with a map, found {name}, which hides images"
            )));
        }
    }
    let counts = hide(args, &key(args)?, &mut out)?;
    out.commit()?;
    print(&format!(
        "{}: {} keypoints of {} images hidden, {} dropped, in {}\n",
        args.scheme.name,
        counts.slots,
        counts.images,
        counts.points,
        OneLine(args.out.display())
    ))?;
    all_could_be("used", &args.path, counts.images, counts.unusable)
}
