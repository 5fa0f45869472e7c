"""What a map costs on many machines: edges of real lists, counted, and what follows on paper. Needs numpy and pyarrow.

    python3 docs/sizing.py LISTS RECOVERED --slots-per-record 1 --core-us 98 --spilled 1370

LISTS and RECOVERED are stage files of one map (or folders of their parts); --core-us and --spilled are microseconds of a core and
bytes written per point, as docs/benchmarks.md measures them.
"""
import argparse
import numpy as np
import pyarrow.parquet as pq

PARTS = (16, 256, 4096)
POINTS = (10**7, 10**9, 10**11)
# A place is three floats, a number eight bytes; a record takes as many as a line does.
PLACE, NUMBER, RECORD = 12, 8, 24


def edges_of(lists, per_record):
    """Slots and the records that they list, end to end; also the other way around, each pair of records once."""
    table = pq.read_table(lists, columns=["slot", "records"]).sort_by("slot")
    lengths = np.concatenate([chunk.value_lengths().to_numpy(zero_copy_only=False) for chunk in table["records"].chunks])
    records = np.concatenate([chunk.flatten().to_numpy() for chunk in table["records"].chunks]).astype(np.int64)
    owners = np.repeat(np.arange(len(lengths)), lengths) // per_record
    pairs = np.unique(np.stack([np.minimum(owners, records), np.maximum(owners, records)]), axis=1)
    return len(lengths), len(records), pairs


def along_a_curve(places):
    """Rows by where they are: bits of the coordinates in turns. Those that are nowhere come last."""
    found = np.isfinite(places).all(axis=1)
    low, high = places[found].min(axis=0), places[found].max(axis=0)
    cells = ((places[found] - low) / max((high - low).max(), 1e-30) * 1023).astype(np.int64)
    keys = np.full(len(places), 1 << 30)
    keys[found] = sum(((cells[:, axis] >> bit) & 1) << (3 * bit + axis) for bit in range(10) for axis in range(3))
    ranks = np.empty(len(places), np.int64)
    ranks[np.argsort(keys, kind="stable")] = np.arange(len(places))
    return ranks


def crossing(pairs, ranks, n_parts):
    """The share of pairs whose ends lie in two parts, and how many places a part needs of others, each once, over its own."""
    part = ranks * n_parts // (ranks.max() + 1)
    a, b = part[pairs[0]], part[pairs[1]]
    apart = a != b
    wanted = np.unique(np.concatenate([np.stack([a, pairs[1]])[:, apart], np.stack([b, pairs[0]])[:, apart]], axis=1), axis=1)
    return apart.mean(), wanted.shape[1] / len(ranks)


def size(n_bytes):
    for unit, of in (("PB", 1e15), ("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if n_bytes >= of:
            return f"{n_bytes / of:.3g} {unit}"
    return f"{n_bytes / 1e3:.3g} kB"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lists")
    parser.add_argument("recovered")
    parser.add_argument("--slots-per-record", type=int, default=1)
    parser.add_argument("--core-us", type=float, required=True)
    parser.add_argument("--spilled", type=float, required=True)
    parser.add_argument("--per-core-hour", type=float, default=0.0408,
                        help="what an hour of a core costs [default: 0.0408 dollars: EC2 m7g.large, two cores, on demand, Linux, us-east-1, June 2026]")
    parser.add_argument("--gigabit", type=float, default=10, help="what a machine of 16 cores sends a second [default: 10]")
    args = parser.parse_args()

    n_slots, n_entries, pairs = edges_of(args.lists, args.slots_per_record)
    rows = pq.read_table(args.recovered, columns=["x", "y", "z"])
    places = np.stack([rows[axis].to_numpy() for axis in "xyz"], axis=1)[:: args.slots_per_record]
    n_records = len(places)
    degree = np.bincount(pairs.reshape(-1), minlength=n_records)
    neighbors = degree.mean()
    print(f"{n_slots:,} slots, {n_entries / n_slots:.1f} entries a list; {neighbors:.1f} records that a record lists or that list it, at most {degree.max()}.\n")
    print("| parts | pairs apart, by number | places of others | pairs apart, by place | places of others |")
    print("| --- | --- | --- | --- | --- |")
    by_number, by_place = np.arange(n_records), along_a_curve(places)
    # Of very large maps: by number, all pairs are apart; by place, parts are large, as the fewest here are.
    near = 1.0
    for n_parts in PARTS:
        if n_records < 20 * n_parts:
            continue
        (a, b), (c, d) = crossing(pairs, by_number, n_parts), crossing(pairs, by_place, n_parts)
        near = min(near, c)
        print(f"| {n_parts} | {100 * a:.1f} % | {b:.1f} a record | {100 * c:.1f} % | {d:.1f} a record |")
    print()
    print("| points | lists | records and places, everywhere | core-hours | hours on 1,000 cores | price | spilled | sent in a round, by number | by place | minutes of a round's sending, 1,000 cores |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    lists = NUMBER * n_entries / n_slots
    message = NUMBER + PLACE * args.slots_per_record
    # 1,000 cores are so many machines.
    network = 1000 / 16 * args.gigabit / 8 * 1e9
    for n in POINTS:
        hours = n * args.core_us / 3.6e9
        n_messages = n / args.slots_per_record * neighbors
        sent = [n_messages * message, n_messages * message * near]
        minutes = sent[0] / network / 60
        print(f"| {n:.0e} | {size(n * lists)} | {size(n * (RECORD / args.slots_per_record + PLACE))} | {hours:,.3g} | {hours / 1000:.2g} | {hours * args.per_core_hour:,.3g} | {size(n * args.spilled)} | {size(sent[0])} | {size(sent[1])} | {minutes:.2g} |")


if __name__ == "__main__":
    main()
