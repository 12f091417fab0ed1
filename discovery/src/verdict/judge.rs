//! The verdict on what was found, from facts alone.

use super::facts::{Disturbance, EffectFacts, Facts, HorizonFacts};
use super::policy::Policy;
use crate::outcome::{HORIZON, NullTest, Verdict};
use crate::weigh::criterion::EVIDENCE;

/// Why a verdict is no better, or what it does not say by itself.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Reason {
    /// Only a force at random that is too small to matter is left (N).
    SmallDisturbance { force: f64 },
    /// Only a force at random is left (N), of which no candidate explains more than chance.
    RandomDisturbance { force: f64 },
    /// Nothing found, but more than noise is left: the gap over a horizon (s), and whether no candidate of chance came near.
    Unexplained { gap: f64, horizon: f64, beyond_chance: bool },
    /// No free run tells anything, and a force at random is left (N).
    ForceLeft { force: f64 },
    /// A share of the winch forces' variance acts at random, and was not recorded.
    Unrecorded { share: f64 },
    /// What was found leaves so much: the gap over a horizon (s) in multiples of what a faultless model would leave.
    MoreIsLeft { gap: f64, horizon: f64 },
    /// What was found explains less than half of the gap.
    ExplainsLittle,
    /// Innovations that are not white, by channel.
    Coloured { channels: Vec<String> },
    /// An effect (its index) whose size is not known well enough for a name: its standard error in multiples of it.
    Uncertain { effect: usize, relative_error: f64 },
    /// An effect whose shape is out of its range.
    OutOfRange { effect: usize },
    /// An effect that leaves nearly all of the gap.
    Little { effect: usize, share: f64 },
    /// An effect whose size differs throughout, where more than noise is left, or nothing more was missed without it: it stands for
    /// a law of another form.
    Unsteady { effect: usize },
    /// An effect that explains less than one that stands for a law of another form, and may be part of what that law does.
    BesideStandIn { effect: usize, stand_in: usize },
    /// An effect that acts at no time that was held out.
    NotHeldOut { effect: usize },
    /// An effect that chance explains as well in so many control runs.
    Chance { effect: usize, runs: usize, of: usize },
    /// Free runs miss by a tenth of the noise or less over a horizon (s), which they cannot.
    BelowNoise { horizon: f64 },
    /// The search ended before all was tried, for its time was over.
    EndedEarly,
    /// Free runs longer than so (s) say nothing: an error of their start grows too fast.
    Growth { horizon: f64 },
}

/// A verdict with its reasons.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Judgement {
    pub(crate) verdict: Verdict,
    pub(crate) reasons: Vec<Reason>,
    /// For each effect, whether it carries its name.
    pub(crate) named: Vec<bool>,
}

/// Judges what was found.
///
/// Gaps count in multiples of what a model without fault would leave, over every horizon up to [`HORIZON`] that the growth of
/// errors allows with what was found, also where the search had to go by a shorter one: over longer ones even the errors of
/// well-known parameters show.
pub(crate) fn judge(facts: &Facts, policy: &Policy) -> Judgement {
    let mut reasons = Vec::new();
    let longest = facts.horizons.iter().filter(|h| h.tells(policy)).map(|h| h.reach.horizon).fold(0.0, f64::max);
    if facts.horizons.iter().any(|h| !h.tells(policy)) {
        reasons.push(Reason::Growth { horizon: longest });
    }
    let counts = |h: &&HorizonFacts| h.tells(policy) && h.reach.horizon <= HORIZON;
    let telling: Vec<&HorizonFacts> = facts.horizons.iter().filter(counts).collect();
    let worst = telling.iter().copied().max_by(|a, b| a.after().total_cmp(&b.after()));
    let white = facts.coloured.is_empty();
    let small = white && (!facts.disturbance.any || facts.disturbance.is_below(policy.small_force));
    // Where no free run tells anything the innovations do.
    let at_noise = worst.map_or(small, |h| h.after() <= policy.at_noise);
    let missed_nothing = telling.iter().all(|h| h.before() <= policy.at_noise);
    let stands_in = |effect: &EffectFacts| (!at_noise || missed_nothing) && effect.varies > policy.unsteady;
    let stand_in = (0..facts.effects.len())
        .filter(|k| stands_in(&facts.effects[*k]))
        .max_by(|a, b| facts.effects[*a].explains.total_cmp(&facts.effects[*b].explains));
    let named: Vec<bool> = facts
        .effects
        .iter()
        .enumerate()
        .map(|(k, effect)| {
            let mut doubts = doubts(k, effect, policy);
            if stands_in(effect) {
                doubts.push(Reason::Unsteady { effect: k });
            } else if let Some(stand_in) = stand_in.filter(|at| facts.effects[*at].explains > effect.explains) {
                doubts.push(Reason::BesideStandIn { effect: k, stand_in });
            }
            let carries = doubts.is_empty();
            reasons.extend(doubts);
            carries
        })
        .collect();
    let below = telling.iter().find(|h| h.after() < policy.least);
    if let Some(below) = below {
        reasons.push(Reason::BelowNoise { horizon: below.reach.horizon });
    }
    let driven = facts.unrecorded <= policy.unrecorded;
    if !driven {
        reasons.push(Reason::Unrecorded { share: facts.unrecorded });
    }
    let nothing_found = facts.effects.is_empty() && facts.terms == 0;
    if worst.is_none() && !at_noise && white {
        reasons.push(Reason::ForceLeft { force: facts.disturbance.force });
    }
    let verdict = if nothing_found {
        match worst {
            _ if facts.contradicted || facts.unlike || below.is_some() => Verdict::Unnamed,
            _ if at_noise && !driven => Verdict::Unnamed,
            _ if at_noise => Verdict::NoMissingEffect,
            Some(_) if small && facts.disturbance.any => {
                reasons.push(Reason::SmallDisturbance { force: facts.disturbance.force });
                Verdict::NoMissingEffect
            }
            Some(_) if at_random(facts, policy) => {
                reasons.push(Reason::RandomDisturbance { force: facts.disturbance.force });
                Verdict::NoMissingEffect
            }
            Some(worst) => {
                let (gap, horizon) = (worst.after(), worst.reach.horizon);
                let beyond_chance = facts.chance.is_some_and(|test| test.as_strong == 0);
                reasons.push(if facts.ended_early {
                    Reason::MoreIsLeft { gap, horizon }
                } else {
                    Reason::Unexplained { gap, horizon, beyond_chance }
                });
                Verdict::Unnamed
            }
            None => Verdict::Unnamed,
        }
    } else if facts.terms > 0 {
        Verdict::Unnamed
    } else {
        // Over a horizon at which nothing was missed there is nothing to explain.
        let mut missed = telling.iter().filter(|h| h.before() > policy.at_noise);
        let little = !at_noise && worst.is_some() && missed.all(|h| h.share_left() > policy.explained);
        if little {
            reasons.push(Reason::ExplainsLittle);
        }
        if let Some(worst) = worst.filter(|_| !at_noise) {
            reasons.push(match facts.disturbance {
                Disturbance { any: true, force, .. } if small => Reason::SmallDisturbance { force },
                _ => Reason::MoreIsLeft { gap: worst.after(), horizon: worst.reach.horizon },
            });
        }
        match () {
            () if little || below.is_some() || !named.contains(&true) => Verdict::Unnamed,
            () if !at_noise || !white || !driven || named.contains(&false) => Verdict::PartlyNamed,
            () if facts.effects.iter().any(|e| e.has_twin) => Verdict::Ambiguous,
            () => Verdict::Named,
        }
    };
    if !white {
        reasons.push(Reason::Coloured { channels: facts.coloured.clone() });
    }
    // Neither has what is missing been looked for everywhere, nor has what was found been held against all that may explain as much.
    let verdict = match verdict {
        Verdict::NoMissingEffect if facts.ended_early => Verdict::Unnamed,
        Verdict::Named if facts.ended_early => Verdict::PartlyNamed,
        verdict => verdict,
    };
    if facts.ended_early {
        reasons.push(Reason::EndedEarly);
    }
    let named = if verdict == Verdict::Unnamed && facts.terms == 0 { vec![false; named.len()] } else { named };
    Judgement { verdict, reasons, named }
}

/// Whether all that is left is a force at random, as of wind that nobody recorded: the innovations are white with it, it is no
/// larger than such forces are, and no candidate explains more of it than chance or than is believed at all.
fn at_random(facts: &Facts, policy: &Policy) -> bool {
    let by_chance = |test: NullTest| test.as_strong > policy.by_chance || test.found < EVIDENCE;
    facts.coloured.is_empty()
        && facts.disturbance.any
        && facts.disturbance.is_below(policy.random_force)
        && facts.chance.is_some_and(by_chance)
}

/// Why an effect does not carry its name.
fn doubts(k: usize, effect: &EffectFacts, policy: &Policy) -> Vec<Reason> {
    let mut doubts = Vec::new();
    if effect.relative_error > policy.uncertain {
        doubts.push(Reason::Uncertain { effect: k, relative_error: effect.relative_error });
    }
    if effect.out_of_range {
        doubts.push(Reason::OutOfRange { effect: k });
    }
    if !effect.held_out {
        doubts.push(Reason::NotHeldOut { effect: k });
    }
    if effect.share < policy.headline {
        doubts.push(Reason::Little { effect: k, share: effect.share });
    }
    if let Some(test) = effect.chance.filter(|test| test.as_strong > policy.by_chance) {
        doubts.push(Reason::Chance { effect: k, runs: test.as_strong, of: test.shifts });
    }
    doubts
}

/// Whether a model beats another one on held-out data: over no horizon that the growth allows may it enlarge the gap beyond
/// its scatter, unless nothing is left; and over one at least it must shrink it, unless the data have become `likelier` by it.
pub(crate) fn beats(horizons: &[HorizonFacts], likelier: bool, policy: &Policy) -> bool {
    let telling = || horizons.iter().filter(|h| h.tells(policy));
    let no_worse = |h: &HorizonFacts| {
        h.change() <= 2.0 * policy.scatter.max(h.scatter) || h.holdout.after <= policy.nothing_left * h.reach.attainable
    };
    telling().all(no_worse) && (likelier || telling().any(|h| h.change() <= -policy.scatter))
}

/// Whether chance may have found all that a model has more than another one: none of it has a size (its standard error in
/// multiples of it) that is known well enough for a name, and free runs show nothing.
pub(crate) fn may_be_chance(
    horizons: &[HorizonFacts],
    relative_errors: impl FnOnce() -> Vec<f64>,
    policy: &Policy,
) -> bool {
    !shows(horizons, policy) && relative_errors().iter().all(|error| *error > policy.uncertain)
}

/// Whether free runs show what a model has more than another one: without it more than noise is left over some horizon that the
/// growth allows, and with it less, by more than chance makes of so many runs.
pub(crate) fn shows(horizons: &[HorizonFacts], policy: &Policy) -> bool {
    let shown = |h: &HorizonFacts| {
        h.holdout.before > policy.at_noise * h.reach.attainable
            && h.change() <= -policy.beyond_scatter * policy.scatter.max(h.scatter)
    };
    horizons.iter().filter(|h| h.tells(policy)).any(shown)
}
