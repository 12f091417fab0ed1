//! A discovery made by hand: Coulomb friction on winch 3, two trials, the second held out.

use std::f64::consts::TAU;

use cdpr::dynamics::Inputs;
use cdpr::effect::{DependsOn, EffectSpec, Place};
use cdpr::geometry::Geometry;
use cdpr::kinematics::cables;
use cdpr::model_file::Model;

use crate::data::{Channel, Trial};
use crate::journal::{Entry, Outcome};
use crate::outcome::{
    Alternative, BeforeAfter, Block, ChannelInstrument, Compared, DetectionLimit, Discovery, Estimated, Found,
    HorizonGap, Instruments, Latents, Located, NullTest, Onset, Remaining, Stability, Verdict, Whiteness,
};

pub(super) const FORCE: f64 = 180.0;
pub(super) const SPEED: f64 = 0.01;
pub(super) const NOISE: f64 = 0.005;
const STEP: f64 = 0.05;
const SAMPLES: usize = 2000;
const RESTART: usize = 100;

pub(crate) fn friction() -> Found {
    let spec = |id: &str, values: &[f64]| EffectSpec::new(id, Some(3), values).unwrap();
    Found {
        named: true,
        effect: spec("winch_coulomb_friction", &[FORCE, SPEED]),
        given: None,
        standard_error: vec![Some(1.9), None],
        onset: Onset::default(),
        delta_bic: -812.4,
        holdout_gap_without: Some(39.5),
        alternatives: vec![
            Alternative {
                effect: spec("pulley_capstan_loss", &[0.009, 0.01]),
                delta_bic: 1.2,
                correlation: Some(0.999),
                indistinguishable: true,
                separate_by: "change the pretension".to_owned(),
            },
            Alternative {
                effect: spec("winch_viscous_friction", &[420.0]),
                delta_bic: 240.0,
                correlation: None,
                indistinguishable: false,
                separate_by: "half and twice the speed".to_owned(),
            },
        ],
        null_test: Some(NullTest { shifts: 99, found: 640.0, as_strong: 0, over_threshold: 12, largest: 31.0 }),
        stability: Some(Stability {
            blocks: [0.97, 1.01, 1.02]
                .into_iter()
                .enumerate()
                .map(|(k, size)| Block {
                    trial: 0,
                    start: 30.0 * k as f64,
                    end: 30.0 * (k + 1) as f64,
                    size,
                    standard_error: 0.02,
                })
                .collect(),
            chi_square: 3.5,
            degrees: 2,
            p_value: 0.17,
            spread: 0.013,
        }),
    }
}

pub(super) fn term(target: &str, expression: &str) -> Found {
    Found {
        named: true,
        effect: EffectSpec::expression(target, expression).unwrap(),
        given: None,
        standard_error: vec![Some(0.6)],
        onset: Onset::default(),
        delta_bic: -52.0,
        holdout_gap_without: None,
        alternatives: Vec::new(),
        null_test: None,
        stability: None,
    }
}

/// What is left over so many seconds, in round numbers.
fn left(horizon: f64) -> Remaining {
    let (position, rotation) = (Some(2e-3 * horizon), Some(3e-4 * horizon));
    Remaining { horizon, position, rotation, length: None, force: 1.5, torque: 12.0 }
}

/// The verdict is `ambiguous`: the first alternative is a twin.
pub(super) fn discovery() -> Discovery {
    let base = Model::default();
    let mut model = base.clone();
    model.effects.push(friction().effect);
    let pair = |before, after| BeforeAfter { before, after };
    let horizon = |horizon, before| HorizonGap {
        horizon,
        train: pair(before, 1.02),
        holdout: pair(before - 1.0, 1.04),
        attainable: 1.01,
        scatter: 0.01,
        judged: true,
        channels: vec![
            (Channel::Pose(0), pair(12.0, 1.0), Some(pair(11.0, 1.01))),
            (Channel::UnstretchedLength(2), pair(9.0, 1.0), None),
        ],
    };
    let trials = vec![compared("runs/held_out.csv", true, 3.0), compared("runs/first.csv", false, 0.0)];
    Discovery {
        verdict: Verdict::Ambiguous,
        base,
        model,
        criterion: -1234.5,
        survey: Vec::new(),
        few_errors: false,
        effects: vec![friction()],
        not_shown: Vec::new(),
        ended_early: false,
        changed: None,
        terms: Vec::new(),
        located: vec![Located {
            place: Place::Winch(Some(3)),
            share: 0.93,
            when: vec![(0, 12.0, 31.5)],
            depends_on: vec![DependsOn::Speed, DependsOn::Direction],
        }],
        horizons: vec![horizon(1.0, 4.0), horizon(5.0, 41.0), horizon(20.0, 300.0)],
        horizon: 5.0,
        remaining: [1.0, 5.0, 20.0].map(left).to_vec(),
        holdout_source: "held_out.csv".to_owned(),
        whiteness: trials[0]
            .trial
            .channels
            .iter()
            .map(|c| Whiteness { channel: *c, noise: NOISE, samples: SAMPLES, statistic: 21.0, limit: 37.6 })
            .collect(),
        instruments: Instruments {
            channels: trials[0].trial.channels.iter().map(|c| instrument(*c)).collect(),
            late_forces: None,
            smoothed_forces: None,
            slow_clock: None,
            winch_force: None,
            stamps: Some(Estimated { value: 4e-3, standard_error: Some(1e-4) }),
        },
        remainder_force: pair(90.0, 1.5),
        remainder_torque: pair(700.0, 12.0),
        trials,
        null_test: Some(NullTest { shifts: 99, found: -12.0, as_strong: 40, over_threshold: 0, largest: -3.0 }),
        candidates: 87,
        outliers: 3,
        journal: vec![Entry {
            effect: Some(friction().effect),
            outcome: Outcome::Added,
            delta_bic: Some(-812.4),
            reason: "largest gain".to_owned(),
        }],
        detection_limits: limits(),
        remarks: vec!["Pretension stays within 3 % of 20 kN.".to_owned()],
        seconds: 12.5,
    }
}

/// Two winches of different certainty, a law that does not show, and one whose size is the smaller the more it does.
fn limits() -> Vec<DetectionLimit> {
    let limit = |id: &str, cable, values: &[f64], parameter: &str, unit, size| DetectionLimit {
        effect: EffectSpec::new(id, cable, values).unwrap(),
        parameter: parameter.to_owned(),
        unit,
        size,
        at_most: false,
        excited: size.is_some(),
        shape: Vec::new(),
    };
    let coulomb = |cable, size| DetectionLimit {
        shape: vec![1],
        ..limit("winch_coulomb_friction", Some(cable), &[50.0, 0.005], "force", "N", Some(size))
    };
    vec![
        coulomb(1, 11.0),
        coulomb(2, 14.0),
        limit("platform_linear_drag", None, &[20.0], "coefficient", "N.s/m", None),
        DetectionLimit {
            at_most: true,
            shape: vec![1],
            ..limit("cable_creep", Some(1), &[3e8, 50.0], "axial_stiffness", "N", Some(2e8))
        },
    ]
}

/// The pose has noise with memory.
fn instrument(channel: Channel) -> ChannelInstrument {
    let pose = matches!(channel, Channel::Pose(_));
    let sized = |value: f64| pose.then_some(Estimated { value, standard_error: Some(0.1 * value) });
    ChannelInstrument {
        channel,
        white: NOISE,
        coloured: sized(3.0 * NOISE),
        time_constant: sized(0.4),
        drift: None,
        origin: None,
        delay: None,
        resolution: None,
    }
}

/// A platform going to and fro; the latent pull at winch 3 is the friction, the model as given drifts off with it.
fn compared(name: &str, holdout: bool, shift: f64) -> Compared {
    let base = Model::default();
    let geometry = Geometry::new(&base.parameters);
    let channels = vec![
        Channel::Pose(0),
        Channel::Pose(1),
        Channel::Pose(2),
        Channel::UnstretchedLength(0),
        Channel::UnstretchedLength(1),
        Channel::UnstretchedLength(2),
        Channel::UnstretchedLength(3),
    ];
    let mut trial = Trial {
        name: name.to_owned(),
        time: Vec::new(),
        inputs: Vec::new(),
        channels: channels.clone(),
        measured: Vec::new(),
        taken_off: Vec::new(),
        undone: Vec::new(),
    };
    let restarts: Vec<usize> = (1..SAMPLES / RESTART).map(|k| k * RESTART).collect();
    let (mut before, mut after) = (Vec::new(), Vec::new());
    let (mut latents, mut motion, mut winch_speed) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..SAMPLES {
        let t = k as f64 * STEP;
        let rate = TAU / 25.0;
        let phase = rate * t + shift;
        let pose = [2.0 * phase.sin(), 1.5 * phase.cos(), 0.0];
        let twist = [2.0 * rate * phase.cos(), -1.5 * rate * phase.sin(), 0.0];
        let cables = cables(&geometry, &pose, &twist);
        let friction = FORCE * (cables[2].speed / SPEED).tanh();
        // Reproducible, and without a memory that a test could trip over.
        let noise = NOISE * (12.9898 * k as f64 + shift).sin();
        let shown: Vec<f64> = pose.iter().copied().chain(cables.iter().map(|c| 0.999 * c.length)).collect();
        let since = ((k % RESTART) as f64 * STEP).powi(2) * 1e-3;
        let simulated = |drift: f64| -> Vec<f64> {
            shown.iter().map(|v| if k < RESTART { f64::NAN } else { v + drift * friction / FORCE }).collect()
        };
        trial.time.push(t);
        trial.inputs.push(Inputs { winch_force: [2e4; 4].into(), ..Inputs::none(4) });
        trial.measured.push(shown.iter().map(|v| if k == 150 { f64::NAN } else { v + noise }).collect());
        before.push(simulated(10.0 * since));
        after.push(simulated(0.0));
        latents.push(Latents { wrench: [0.0; 3], pull: [0.0, 0.0, friction, 0.0].into() });
        motion.push([pose[0], pose[1], pose[2], twist[0], twist[1], twist[2]]);
        winch_speed.push(cables.map(|c| c.speed));
    }
    let expected = vec![NOISE; trial.channels.len()];
    Compared { trial, holdout, before, after, restarts, expected, latents, motion, winch_speed }
}
