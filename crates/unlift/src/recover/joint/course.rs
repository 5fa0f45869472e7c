//! How rounds of joint recovery follow each other: what is learned anew, and when it is enough.

use std::io::{self, Write};
use std::sync::Arc;

use sha2::{Digest as _, Sha256};

use super::agreement::Judges;
use super::jumps::Jumps;
use super::look::{Look, Sample};
use super::neighbor_law::Law;
use super::standing::Standing;
use super::wire::{read_estimates, write_estimates};
use crate::Error;
use crate::recover::map::bytes::{Reader, Writer};
use crate::recover::map::crowding::Density;
use crate::recover::map::graph::Graph;
use crate::recover::map::pieces::Pieces;
use crate::recover::map::places::Places;
use crate::recover::result::estimate::Estimate;
use crate::recover::solve::Moved;

/// Sweeps over all slots at most: a bound for maps that never settle.
const SWEEPS: usize = 16;
/// Rounds of a sweep: in each, every so many-th slot moves. In the first sweep all move at once: its
/// estimates come from records alone, no slot has followed another yet.
const TURNS: usize = 2;
/// True neighbors are looked for within this many radii of the law: nearly all of its mass.
const REACH: f32 = 4.0;
/// The radius of the law is at least this share of the largest coordinate: estimates of one place differ by rounding.
const ROUNDING: f32 = 8.0 * f32::EPSILON;
/// The density of estimates is smooth over this many radii of the law: it must not follow the very crowds that it judges.
const SMOOTH: f32 = 4.5;
/// Sweeps end when fewer than this share of the slots jump farther than a radius of the law: so few hardly change anything.
const SETTLED: f64 = 0.03;
/// Law and density are learned again when more than this share of the slots jumped since. Learned once per sweep,
/// maps of paired lines and of planes come back worse.
const STALE: f64 = 0.02;
/// Sweeps end when as many as this share of those that moved before move again: estimates go to and fro.
const SLOW: f64 = 0.9;
/// Sweeps end when records agree by this share less than they did at best: a little less is noise.
const WORSE: f64 = 0.08;

/// What is kept of the edges of a map, and never changes: all that rounds follow each other by.
pub(crate) struct Digest {
    /// How often each record is listed.
    pub(crate) listed: Vec<u32>,
    /// What the law is learned from.
    pub(crate) sample: Sample,
    /// Whom sweeps are judged by.
    pub(crate) judges: Judges,
}

impl Digest {
    /// That of `graph`.
    ///
    /// # Errors
    /// When edges cannot be read.
    pub(super) fn new(graph: &Graph, seed: u64) -> Result<Self, Error> {
        let (sample, judges) = (Sample::new(graph, seed)?, Judges::new(graph)?);
        Ok(Self { listed: graph.times_listed()?, sample, judges })
    }

    /// Appends all of it.
    pub(super) fn write(&self, to: &mut Writer) {
        to.u32s(&self.listed);
        self.sample.write(to);
        self.judges.write(to);
    }

    /// A hash of all of it: what tells these edges from others.
    pub(super) fn hash(&self) -> [u8; 32] {
        let mut bytes = Writer::default();
        self.write(&mut bytes);
        Sha256::digest(bytes.into_bytes()).into()
    }
}

/// What is asked of a family of records besides where they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kind {
    slots_per_record: usize,
    tells_region: bool,
    most_radius: f32,
}

impl Kind {
    /// That of `pieces`, for a `delta`.
    pub(crate) fn of<const D: usize, P: Pieces<D>>(pieces: &P, delta: f32) -> Self {
        let slots_per_record = pieces.slots_per_record();
        let most_radius = P::MOST_RADIUS * delta;
        Self { slots_per_record, tells_region: P::TELLS_REGION, most_radius }
    }
}

/// Rounds, one after the other.
pub(crate) struct Course<const D: usize> {
    kind: Kind,
    digest: Arc<Digest>,
    least_radius: f32,
    /// The best estimates of whole sweeps.
    now: Vec<Estimate<D>>,
    standing: Standing<D>,
    /// Slots that jumped in the round under way.
    jumpers: Vec<u32>,
    sweep: usize,
    /// Slots that jumped in this sweep, in the one before, and since law and density were learned.
    n_jumped: usize,
    n_jumped_before: usize,
    n_jumped_since: usize,
    /// How well records agreed at best.
    most: f64,
}

impl<const D: usize> Course<D> {
    /// Before the first round, at `start`.
    pub(crate) fn new(kind: Kind, digest: Arc<Digest>, start: &[Estimate<D>]) -> Self {
        let n = start.len();
        let places = Places::new(start);
        let least_radius = (ROUNDING * places.farthest()).max(f32::MIN_POSITIVE);
        let (density, law) = learned(kind, &places, &digest, kind.most_radius, least_radius);
        let standing = Standing {
            next: start.to_vec(),
            places,
            density,
            law,
            ahead: vec![0.0; n],
            jumps: Jumps::new(n),
            turns: 1,
            turn: 0,
            done: false,
        };
        Self {
            kind,
            digest,
            least_radius,
            now: start.to_vec(),
            standing,
            jumpers: Vec::new(),
            sweep: 0,
            n_jumped: 0,
            // Nothing is settled yet.
            n_jumped_before: n,
            n_jumped_since: 0,
            most: f64::NEG_INFINITY,
        }
    }

    /// Appends all but what is asked of the map and its edges.
    pub(crate) fn write<W: Write>(&self, to: &mut Writer<W>) {
        to.f32s(&[self.least_radius]);
        to.f64(self.most);
        let counts = [self.sweep, self.n_jumped, self.n_jumped_before, self.n_jumped_since];
        counts.iter().for_each(|&n| to.u64(n as u64));
        write_estimates(&self.now, to);
        // Written twice: there may be no memory for a copy.
        let mut counted = Writer::new(io::sink());
        self.standing.write(&mut counted);
        to.u64(counted.written());
        self.standing.write(to);
    }

    /// What [`write`](Self::write) appended of a course between two rounds, of a map with so many slots.
    ///
    /// # Errors
    /// When it is anything else.
    pub(crate) fn read(
        from: &mut Reader<'_>,
        (kind, digest): (Kind, Arc<Digest>),
        n_slots: usize,
    ) -> Result<Self, Error> {
        let (least_radius, most) = (from.f32()?, from.f64()?);
        if !(least_radius.is_normal() && least_radius > 0.0) || most.is_nan() {
            return Err(from.wrong("numbers", format!("{least_radius}, {most}")));
        }
        let sweep = from.count(SWEEPS - 1)?;
        let [n_jumped, n_jumped_before, n_jumped_since] =
            [from.count(n_slots)?, from.count(n_slots)?, from.count(SWEEPS * n_slots)?];
        let now = read_estimates(from, n_slots)?;
        let length = from.count(usize::MAX)?;
        let standing = Standing::from_bytes(from.bytes(length)?, n_slots)?;
        if standing.turns > TURNS {
            return Err(from.wrong(format!("{TURNS} turns at most"), standing.turns.to_string()));
        }
        let jumpers = Vec::new();
        Ok(Self {
            kind,
            digest,
            least_radius,
            now,
            standing,
            jumpers,
            sweep,
            n_jumped,
            n_jumped_before,
            n_jumped_since,
            most,
        })
    }

    /// The estimates that it holds.
    pub(crate) fn all_estimates(&self) -> impl Iterator<Item = &Estimate<D>> {
        self.now.iter().chain(&self.standing.next)
    }

    /// The rounds of the same map from another `start`.
    pub(crate) fn anew(&self, start: &[Estimate<D>]) -> Self {
        Self::new(self.kind, Arc::clone(&self.digest), start)
    }

    /// What it follows edges by.
    pub(super) fn digest(&self) -> &Digest {
        &self.digest
    }

    /// Where the round stands.
    pub(crate) fn standing(&self) -> &Standing<D> {
        &self.standing
    }

    /// Whether there is no further round.
    pub(crate) fn is_done(&self) -> bool {
        self.standing.done
    }

    /// Some slots whose turn it is have moved.
    pub(crate) fn take(&mut self, moved: &[Moved<D>]) {
        for moved in moved {
            if self.standing.take(*moved) {
                self.jumpers.push(moved.slot);
            }
        }
    }

    /// All slots whose turn it was have moved: those that jumped, and the places of all. They have to be told to whom it
    /// concerns before the course [`goes on`](Self::go_on).
    pub(crate) fn moved(&mut self) -> (Vec<u32>, Places<D>) {
        let jumpers = std::mem::take(&mut self.jumpers);
        self.n_jumped += jumpers.len();
        self.n_jumped_since += jumpers.len();
        (jumpers, Places::new(&self.standing.next))
    }

    /// Whether the round under way is the last of its sweep.
    pub(crate) fn ends_sweep(&self) -> bool {
        self.standing.turn + 1 == self.standing.turns
    }

    /// So many jumps concern each of these slots, whoever told them.
    pub(crate) fn tell(&mut self, concerning: &[(u32, u32)]) {
        for &(slot, jumps) in concerning {
            self.standing.jumps.add(slot as usize, jumps);
        }
    }

    /// Begins the next round, if there is one, with slots at these `places`. `agree` says how well records agree with
    /// estimates, where it is asked for.
    pub(crate) fn go_on(
        &mut self,
        places: Places<D>,
        agree: impl FnOnce(&Judges, &[Estimate<D>]) -> f64,
    ) {
        self.standing.places = places;
        self.standing.turn += 1;
        if self.standing.turn == self.standing.turns {
            self.end_sweep(agree);
        }
        if !self.standing.done {
            self.learn_again();
        }
    }

    /// Where slots are believed to be.
    pub(crate) fn estimates(&self) -> &[Estimate<D>] {
        if self.standing.done { &self.now } else { &self.standing.next }
    }

    /// The same, the last time that they are asked for.
    pub(crate) fn into_estimates(self) -> Vec<Estimate<D>> {
        if self.standing.done { self.now } else { self.standing.next }
    }

    /// Judges a sweep and begins the next one, if there is one.
    fn end_sweep(&mut self, agree: impl FnOnce(&Judges, &[Estimate<D>]) -> f64) {
        let n = self.now.len();
        self.standing.done = true;
        if (self.n_jumped as f64) < SETTLED * n as f64 {
            // So few hardly made it worse.
            self.now.clone_from(&self.standing.next);
            return;
        }
        let agreement = agree(&self.digest.judges, &self.standing.next);
        if agreement < (1.0 - WORSE) * self.most {
            return;
        }
        self.most = self.most.max(agreement);
        self.now.clone_from(&self.standing.next);
        let slow = self.n_jumped as f64 > SLOW * self.n_jumped_before as f64;
        if 2 * self.n_jumped < n && slow || self.sweep + 1 == SWEEPS {
            return;
        }
        self.sweep += 1;
        (self.standing.done, self.standing.turns, self.standing.turn) = (false, TURNS, 0);
        self.n_jumped_before = std::mem::take(&mut self.n_jumped);
    }

    /// Learns law and density of the present places, if enough slots jumped since.
    fn learn_again(&mut self) {
        let standing = &mut self.standing;
        if self.n_jumped_since as f64 <= STALE * standing.next.len() as f64 {
            return;
        }
        let (places, radius) = (&standing.places, standing.law.radius);
        let (density, law) = learned(self.kind, places, &self.digest, radius, self.least_radius);
        if law.surplus != standing.law.surplus {
            // Leads found under another rule say nothing.
            standing.ahead.fill(0.0);
        }
        (standing.density, standing.law) = (density, law);
        self.n_jumped_since = 0;
    }
}

/// Density and law of `places`, with neighbors looked for as if `radius` were that of the law.
fn learned<const D: usize>(
    kind: Kind,
    places: &Places<D>,
    digest: &Digest,
    radius: f32,
    least_radius: f32,
) -> (Density<D>, Law) {
    let density = Density::new(places, &digest.listed, SMOOTH * radius);
    let law = Law::learn(&Look {
        places,
        density: &density,
        slots_per_record: kind.slots_per_record,
        reach: REACH * radius,
        tells_region: kind.tells_region,
        least_radius,
        most_radius: kind.most_radius,
        sample: &digest.sample,
    });
    (density, law)
}
