//! Discovery on recordings, maps and models that nobody should give it: a verdict or an error, never a panic.

use std::fmt::Write as _;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;
use std::time::Duration;

use cdpr::model_file::Model;

use crate::calibrate::calibrate;
use crate::check::check;
use crate::data::recording::{noise, record};
use crate::data::{ColumnMap, Trial, read_trial};
use crate::discover::{examine, prepare};
use crate::strategy::time_limit::Hours;

static TRAIN: LazyLock<Trial> = LazyLock::new(|| record(&[], 10.0, 21));
static HELD: LazyLock<Trial> = LazyLock::new(|| record(&[], 6.0, 22));

const MODELS: [&str; 8] = [
    "",
    "cable_density = 0.0\n",
    "cable_model = \"rigid\"\n",
    "cable_model = \"massless_spring\"\n",
    "platform_mass = 1e-3\nplatform_inertia = 1e9\n",
    "cable_damping = 0.0\nyoungs_modulus = 1e6\n",
    "[[effect]]\nid = \"winch_delay\"\ndelay = 3.0\n[[effect]]\nid = \"pose_sensor_delay\"\ndelay = 1.0\n",
    "[[effect]]\nid = \"winch_saturation\"\nlower = 0.0\nupper = 1.0\n",
];

/// Whole numbers below a bound.
struct Dice(Vec<f64>);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(noise(64, seed).collect())
    }

    fn below(&mut self, bound: usize) -> usize {
        let thrown = self.0.pop().expect("dice enough");
        ((thrown * 1e6).rem_euclid(bound as f64) as usize).min(bound - 1)
    }
}

/// Scales, negates, exchanges, empties, shifts or freezes columns. Columns are the four winch forces, then the channels.
fn spoil(trial: &mut Trial, dice: &mut Dice) {
    let columns = 4 + trial.channels.len();
    let rows = trial.len();
    let get = |trial: &Trial, c: usize, k: usize| {
        if c < 4 { trial.inputs[k].winch_force[c] } else { trial.measured[k][c - 4] }
    };
    let set = |trial: &mut Trial, c: usize, k: usize, value: f64| {
        if c < 4 { trial.inputs[k].winch_force[c] = value } else { trial.measured[k][c - 4] = value }
    };
    let chosen: Vec<usize> = match dice.below(4) {
        0 => (0..4).collect(),
        1 => (4..columns).collect(),
        _ => vec![dice.below(columns)],
    };
    let (kind, other, factor, shift) = (dice.below(8), dice.below(columns), dice.below(6), dice.below(rows));
    let old = trial.clone();
    for k in 0..rows {
        for c in chosen.iter().copied() {
            let value = get(&old, c, k);
            let new = match kind {
                0 => [1e-6, 1e-3, 1e3, 1e9, 0.0, 57.3][factor] * value,
                1 => -value,
                2 => get(&old, other, k),
                3 if c >= 4 => f64::NAN,
                4 => get(&old, c, (k + shift) % rows),
                5 => get(&old, c, 0),
                6 => value + [1e-3, 1.0, 100.0, -1e3, 1e5, 1e12][factor],
                7 if c >= 4 && k % (2 + factor) != 0 => f64::NAN,
                _ => value,
            };
            set(trial, c, k, new);
        }
    }
    match dice.below(12) {
        0 => trial.time.iter_mut().for_each(|t| *t *= 1e-6),
        1 => trial.time.iter_mut().for_each(|t| *t = 1.7e9 + 10.0 * *t),
        2 => trial.time.iter_mut().skip(rows / 2).for_each(|t| *t += 1e4),
        _ => {}
    }
}

/// A table of a trial, with columns of its own names, and a map to it.
fn written(trial: &Trial, dice: &mut Dice) -> (String, String) {
    let mut names = vec!["time".to_owned()];
    names.extend((1..=4).map(|i| format!("winch_force[{i}]")));
    names.extend(trial.channels.iter().map(|c| c.name()));
    let mut table = (0..names.len()).map(|c| format!("c{c}")).collect::<Vec<_>>().join(",") + "\n";
    for k in 0..trial.len() {
        let values =
            [trial.time[k]].into_iter().chain(trial.inputs[k].winch_force).chain(trial.measured[k].iter().copied());
        let cells: Vec<String> = values.map(|v| if v.is_nan() { String::new() } else { v.to_string() }).collect();
        let _ = writeln!(table, "{}", cells.join(","));
    }
    let odd = dice.below(names.len());
    let mut map = String::new();
    for (c, name) in names.iter().enumerate() {
        let extra = match (c == odd, dice.below(6)) {
            (false, _) => "",
            (_, 0) => ", scale = 1e300",
            (_, 1) => ", scale = -1",
            (_, 2) => ", offset = -1e6",
            (_, 3) => ", unit = \"mm\", scale = 2",
            (_, 4) => ", scale = 1e-300",
            _ => ", unit = \"furlong\"",
        };
        let _ = writeln!(map, "\"{name}\" = {{ column = \"c{c}\"{extra} }}");
    }
    (table, map)
}

/// Recordings written and read, made ready and checked against models of all kinds.
#[test]
fn whatever_is_read_is_refused_or_checked_without_a_panic() {
    let folder = tempfile::tempdir().unwrap();
    let (table, map) = (folder.path().join("run.csv"), folder.path().join("map.toml"));
    let (mut read, mut passed) = (0, 0);
    for seed in 0..60 {
        let dice = &mut Dice::new(seed);
        let model = Model::from_toml(MODELS[dice.below(MODELS.len())]).unwrap();
        let mut trial = TRAIN.clone();
        (0..dice.below(3)).for_each(|_| spoil(&mut trial, dice));
        let (cells, entries) = written(&trial, dice);
        std::fs::write(&table, cells).unwrap();
        std::fs::write(&map, entries).unwrap();
        let done = catch_unwind(|| -> Result<(), String> {
            let map = ColumnMap::read(&map, 4).map_err(|e| e.to_string())?;
            let trial = read_trial(&table, &map, 4).map_err(|e| e.to_string())?;
            prepare(vec![trial.clone()], vec![HELD.clone()])?;
            let checked = check(&model, [&trial].into_iter()).map(|_| ());
            // Whatever comes of it.
            drop(calibrate(&model, &[trial]));
            checked
        });
        match done.unwrap_or_else(|_| panic!("seed {seed}")) {
            Ok(()) => passed += 1,
            Err(message) => assert!(!message.is_empty()),
        }
        read += 1;
    }
    assert!(passed > 3 && passed < read - 10, "{passed} of {read}: the dice throw too much of one kind");
}

/// Time for a search (s): most end before it, and one that does not must end with it.
const TIME: u64 = 4;

fn searched(seed: usize, model: &str, trial: Trial) {
    let model = Model::from_toml(model).unwrap();
    let done = catch_unwind(AssertUnwindSafe(|| match prepare(vec![trial], vec![HELD.clone()]) {
        Ok(ready) => examine(
            &model,
            None,
            model.effects.len(),
            ready,
            Hours::from_now(Some(Duration::from_secs(TIME))),
            &|_, _| {},
        )
        .map_or_else(|e| e.to_string(), |d| format!("{:?}", d.verdict)),
        Err(message) => message,
    }));
    assert!(!done.unwrap_or_else(|_| panic!("panic with {seed}")).is_empty());
}

/// The search itself, without the check that would have refused most of it.
#[test]
fn a_search_on_spoiled_recordings_ends_without_a_panic() {
    for seed in 100..106 {
        let dice = &mut Dice::new(seed);
        let model = MODELS[dice.below(MODELS.len())];
        let mut trial = TRAIN.clone();
        spoil(&mut trial, dice);
        searched(seed as usize, model, trial);
    }
}

#[test]
fn a_search_on_forces_that_all_push_ends_without_a_panic() {
    let mut trial = TRAIN.clone();
    trial.inputs.iter_mut().for_each(|inputs| inputs.winch_force.iter_mut().for_each(|f| *f *= -1.0));
    searched(0, "", trial);
}

#[test]
fn a_search_with_cables_without_mass_ends_without_a_panic() {
    searched(0, "cable_density = 0.0\n", record(&[], 10.0, 23));
}

#[test]
fn a_search_with_channels_sampled_in_turn_ends_without_a_panic() {
    let mut trial = TRAIN.clone();
    for (k, row) in trial.measured.iter_mut().enumerate() {
        row.iter_mut().enumerate().filter(|(j, _)| k % (2 + j % 3) != 0).for_each(|(_, v)| *v = f64::NAN);
    }
    searched(0, "", trial);
}
