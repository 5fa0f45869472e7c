//! `unlift obfuscate`: a map in, a released file and a truth file out.

use unlift::audit::Plan;
use unlift::obfuscate::obfuscate;
use unlift::seed::Key;
use unlift_io::atomic::{Access, Kind, OutputSet, Rules};
use unlift_io::stage::{Kind as Stage, write_released, write_truth};

use super::open_map;
use crate::args::ObfuscateArgs;
use crate::exit::{Outcome, usage};
use crate::output::print;
use crate::outputs::refused;

/// What the attacker sees.
pub const RELEASED: &str = "released.parquet";
/// What only the owner has.
pub const TRUTH: &str = "truth.parquet";

/// What an integer seed is worth.
const GUESSABLE: &str = "unlift: note: --seed repeats experiments; whoever guesses the number undoes the hiding: \
    do not release this map";

/// Hides a map by one scheme.
pub fn run(args: &ObfuscateArgs) -> anyhow::Result<Outcome> {
    let inputs = [args.path.as_path()].into_iter().chain(args.map.descriptors.as_deref());
    let files = [(RELEASED, Kind::Stage(Stage::Released)), (TRUTH, Kind::Stage(Stage::Truth))];
    let rules = Rules::new(inputs, args.force);
    let mut out = OutputSet::create(&args.out, rules, Access::Private, &files).map_err(refused)?;
    let (_, prepared) = open_map(&args.path, &args.map, false)?;
    let name = args.scheme.name;
    let scheme = args.scheme.in_3d.ok_or_else(|| usage(format!("{name} is not for maps")))?;
    let options = Plan::new(prepared.original.reveal().unit()).scheme_options;
    let descriptors = prepared.descriptors.as_ref();
    let key = match args.map.seed {
        Some(seed) => {
            eprintln!("{GUESSABLE}");
            Key::from_seed(seed)
        }
        None => Key::fresh()?,
    };
    let hidden = obfuscate(scheme, &prepared.original, descriptors, &options, &key);
    let (released, secret) = hidden.map_err(|e| unlift_io::Error::core(&args.path, e))?;
    write_truth(&out.stage(TRUTH, Kind::Stage(Stage::Truth))?, &prepared.original, &secret)?;
    write_released(&out.stage(RELEASED, Kind::Stage(Stage::Released))?, &released)?;
    out.commit()?;
    print(&format!(
        "{name}: {} points hidden in {} records, {} dropped, in {}\n",
        released.n_slots(),
        released.n_records(),
        secret.dropped().len(),
        args.out.display()
    ))?;
    Ok(Outcome::Done)
}
