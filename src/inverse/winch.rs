//! From the pull that a cable must feel back to the force that its winch must be told.

use num_dual::Dual64;

use super::wrench::Prescribed;
use super::{InverseError, Jet, Rigid};
use crate::dynamics::{Inputs, MAX_EFFECT_STATES};
use crate::effect::{EffectKind, PlatformContext, WinchContext};
use crate::kinematics::CableKinematics;
use crate::parameters::CableModel;
use crate::per_cable::PerCable;
use crate::plant::Plant;

/// Most rounds of the fixed point where winch terms depend on the winch forces.
const ROUNDS: usize = 50;

/// Winch forces (N) and the states of the winches' own effects that go with them.
pub(super) struct WinchSide {
    pub(super) force: PerCable<f64>,
    pub(super) states: PerCable<[f64; MAX_EFFECT_STATES]>,
}

/// Winch forces under which the cables feel `pull` (jets good to first order).
pub(super) fn forces(
    plant: &Plant,
    pull: &PerCable<Jet>,
    context: &PlatformContext<'_, Jet>,
) -> Result<WinchSide, InverseError> {
    let time = context.time;
    let mut force = pull.map(|p| p.re);
    for _ in 0..ROUNDS {
        let inputs = Inputs { winch_force: force.map(Jet::from), ..*context.inputs };
        let context = PlatformContext { inputs: &inputs, ..*context };
        let cables = plant.cables();
        let mut states = PerCable::filled(cables, [0.0; MAX_EFFECT_STATES]);
        let mut next = PerCable::filled(cables, 0.0);
        for i in 0..cables {
            let added = plant.chain(i).added(&context);
            let winch = WinchContext { time, speed: context.unstretched_rate[i] };
            next[i] = command(plant, i, pull[i], added, &winch, &mut states[i])?;
        }
        let change = (0..cables).map(|i| (next[i] - force[i]).abs()).fold(0.0, f64::max);
        let size = next.iter().fold(1.0_f64, |a, b| a.max(b.abs()));
        force = next;
        if !plant.winch_terms_use_forces() || change <= 1e-13 * size {
            return Ok(WinchSide { force, states });
        }
    }
    Err(InverseError::NotInvertible {
        time: time.re,
        cable: None,
        effect: "expression",
        reason: "the winch forces that it depends on do not settle".to_owned(),
    })
}

/// The tension (N) of `cable` under this winch force (N), the motion prescribed and what follows a command settled; but for what
/// the rate of the tension itself takes in an elastic cable.
pub(super) fn tension_under(
    plant: &Plant,
    cable: usize,
    force: f64,
    motion: &Prescribed<Jet>,
    k: &CableKinematics<Jet>,
    context: &PlatformContext<'_, Jet>,
) -> Jet {
    let chain = plant.chain(cable);
    let winch = WinchContext { time: motion.time, speed: k.speed };
    let settled = chain.effects.command.iter().filter(|(kind, _)| kind.states() == 0);
    let force = settled.fold(Jet::from(force), |force, (kind, _)| kind.command(force, &[], &mut [], &winch));
    let driven = force + chain.added(context);
    let pull = chain.effects.loss.iter().fold(driven, |sum, (kind, _)| sum + kind.loss(driven, &winch));
    let end = [k.length, k.speed, k.length_acceleration(&motion.acceleration, motion.twist[2])];
    let tension = pull + chain.axial_force(end, k.angular_rate);
    if chain.data.model != CableModel::LumpedMass || tension.re <= 0.0 {
        return tension;
    }
    // The winch end moves as the chord does, shorter by the strain.
    let states = [Jet::from(0.0); MAX_EFFECT_STATES];
    let shorter = chain.unstretched_length(motion.time, k.length, tension, &states) / k.length;
    pull + chain.axial_force(end.map(|value| value * shorter), k.angular_rate)
}

/// What winches that are to pull with these forces (N) are told, in the unit of their command.
pub(super) fn commands(
    plant: &Plant,
    force: &PerCable<f64>,
    rigid: &Rigid,
    unstretched: &PerCable<Jet>,
) -> Result<PerCable<f64>, InverseError> {
    let mut command = *force;
    for (i, command) in command.iter_mut().enumerate() {
        let winch = &plant.data().cables[i].winch;
        if !winch.command.is_servo() {
            *command /= winch.force_per_command();
            continue;
        }
        if command.abs() > winch.force_limit {
            return Err(InverseError::BeyondLimit {
                time: rigid.prescribed.time.re,
                cable: i + 1,
                force: *command,
                limit: winch.force_limit,
            });
        }
        let (paid_out, turning) = ([unstretched[i].re, unstretched[i].v1], rigid.angular_rate[i].re);
        *command = plant.chain(i).servo_command(*command, rigid.tension[i].re, paid_out, turning);
    }
    Ok(command)
}

/// The command of one winch behind whose effects, with the force `added` before its losses, the pull is `pull`.
fn command(
    plant: &Plant,
    cable: usize,
    pull: Jet,
    added: Jet,
    context: &WinchContext<Jet>,
    states: &mut [f64; MAX_EFFECT_STATES],
) -> Result<f64, InverseError> {
    let effects = &plant.cable[cable];
    let fail = |kind: &EffectKind, reason: String| InverseError::NotInvertible {
        time: context.time.re,
        cable: Some(cable + 1),
        effect: kind.info().id,
        reason,
    };
    let mut force = pull;
    if let Some((kind, _)) = effects.loss.iter().find(|(kind, _)| kind.states() > 0) {
        return Err(fail(kind, "its presliding depends on how the winch has moved before".to_owned()));
    }
    if let Some((first, _)) = effects.loss.first() {
        let felt = |force: Jet| effects.loss.iter().fold(force, |sum, (kind, _)| sum + kind.loss(force, context));
        let slope = |force: f64| {
            let winch = WinchContext { time: Dual64::from(context.time.re), speed: Dual64::from(context.speed.re) };
            let force = Dual64::from_re(force).derivative();
            effects.loss.iter().fold(force, |sum, (kind, _)| sum + kind.loss(force, &winch)).eps
        };
        force = solve(pull, felt, slope)
            .ok_or_else(|| fail(first, format!("no winch force overcomes it at a pull of {:.6} N", pull.re)))?;
    }
    force -= added;
    for (kind, at) in effects.command.iter().rev() {
        if kind.states() > 0 {
            // Such an effect hands on its own state, and its state's rate follows from the force before it.
            states[*at] = force.re;
            let rate = |before: Dual64| {
                let winch = WinchContext { time: Dual64::from(context.time.re), speed: Dual64::from(context.speed.re) };
                let mut rates = [Dual64::from(0.0); MAX_EFFECT_STATES];
                kind.command(before, &[Dual64::from(force.re)], &mut rates, &winch);
                rates[0]
            };
            let settled = rate(Dual64::from_re(force.re).derivative());
            let before = force.re + (force.v1 - settled.re) / settled.eps;
            let (reached, wanted) = (rate(before.into()).re, force.v1);
            if (reached - wanted).abs() > 1e-9 * (1.0 + wanted.abs()) {
                return Err(fail(kind, format!("the force would change by {wanted:.6} N/s, beyond {reached:.6} N/s")));
            }
            force = Jet::from(before);
        } else {
            let pass = |force: Jet| kind.command(force, &[], &mut [], context);
            let slope = |force: f64| {
                let winch = WinchContext { time: Dual64::from(context.time.re), speed: Dual64::from(context.speed.re) };
                kind.command(Dual64::from_re(force).derivative(), &[], &mut [], &winch).eps
            };
            force = solve(force, pass, slope)
                .ok_or_else(|| fail(kind, format!("no winch force makes {:.6} N behind it", force.re)))?;
        }
    }
    Ok(force.re)
}

/// Solves `function(x) = target` for a function that is nearly the identity, by Newton's method, with derivatives.
fn solve(target: Jet, function: impl Fn(Jet) -> Jet, slope: impl Fn(f64) -> f64) -> Option<Jet> {
    let mut x = target.re;
    let size = target.re.abs().max(1.0);
    for _ in 0..50 {
        let misfit = function(Jet::from(x)).re - target.re;
        if misfit.abs() <= 1e-13 * size {
            let k = slope(x);
            if k == 0.0 {
                // At or beyond a limit the derivative is lost, the value stands.
                return Some(Jet::from(x));
            }
            let mut refined = Jet::from(x);
            for _ in 0..3 {
                refined -= (function(refined) - target) / k;
            }
            return Some(refined);
        }
        let k = slope(x);
        if k == 0.0 || !k.is_finite() {
            return None;
        }
        x -= misfit / k;
    }
    None
}
