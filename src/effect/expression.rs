//! Any force, torque or winch-force term written as an expression: the symbolic fallback.

use super::{Axis, Effect, EffectInfo, EffectSpec, Place, PlatformContext, Scope, Site, SpecError, Stage, TextInfo};
use crate::formula::{Formula, GRAMMAR, Variable};
use crate::per_cable::MAX_CABLES;
use crate::scalar::Real;
use crate::winch::WinchCommand;

/// A term given as text, added to one axis of the platform's wrench or to one winch force.
///
/// `target` is `platform.force_x`, `platform.force_y` (N), `platform.torque` (N m) or `winch[1]` to `winch[n]` (N,
/// added to the pull). The text may use the variables of [`crate::formula`]: pose, twist, time, inputs, lengths and speeds.
///
/// Dry friction can be written with `sign`, which turns smoothly over 1e-6 of its argument's unit: `-500*sign(vx)` sticks at a
/// creep of that many m/s. Kinks, as of `abs`, are left to the error control.
///
/// Shows in: the residual of its target.
///
/// Valid for: the range of the data it was found on.
///
/// Source: S. L. Brunton, J. L. Proctor, J. N. Kutz, Discovering governing equations from data, PNAS 113 (2016) (sparse regression over a dictionary).
#[derive(Clone, Debug)]
pub struct Expression {
    target: Target,
    formula: Formula,
}

const TARGETS: &str =
    "platform.force_x, platform.force_y (N), platform.torque (N.m) or winch[1] to winch[n] (N, added to the pull)";

#[derive(Clone, Copy, Debug)]
enum Target {
    Platform(usize),
    Winch(usize),
}

fn read_target(text: &str) -> Option<Target> {
    Some(match text {
        "platform.force_x" => Target::Platform(0),
        "platform.force_y" => Target::Platform(1),
        "platform.torque" => Target::Platform(2),
        _ => {
            let index = text.strip_prefix("winch[")?.strip_suffix(']')?;
            // One way to write each number.
            let found = (1..=MAX_CABLES).find(|cable| cable.to_string() == index)?;
            Target::Winch(found - 1)
        }
    })
}

/// Where the term of `spec` acts.
pub(super) fn place(spec: &EffectSpec) -> Result<Place, SpecError> {
    Ok(match Expression::new(spec)?.target {
        Target::Platform(axis) => Place::Platform([Axis::ForceX, Axis::ForceY, Axis::Torque][axis]),
        Target::Winch(i) => Place::Winch(Some(i + 1)),
    })
}

/// The term of `spec`.
pub(super) fn formula(spec: &EffectSpec) -> Result<Formula, SpecError> {
    Ok(Expression::new(spec)?.formula)
}

impl Expression {
    /// The term.
    pub fn formula(&self) -> &Formula {
        &self.formula
    }

    /// The winch (from 0) whose force the term is added to, if it is one.
    pub fn winch(&self) -> Option<usize> {
        match self.target {
            Target::Winch(i) => Some(i),
            Target::Platform(_) => None,
        }
    }

    fn value<S: Real>(&self, context: &PlatformContext<'_, S>) -> S {
        self.formula.value(|variable| match variable {
            Variable::Time => context.time,
            Variable::Pose(k) => context.pose[k],
            Variable::Twist(k) => context.twist[k],
            Variable::WinchForce(i) => context.inputs.winch_force[i],
            Variable::Disturbance(k) => context.inputs.disturbance[k],
            Variable::CableLength(i) => context.cable_length[i],
            Variable::CableSpeed(i) => context.cable_speed[i],
            Variable::UnstretchedLength(i) => context.unstretched_length[i],
            Variable::UnstretchedRate(i) => context.unstretched_rate[i],
        })
    }
}

impl Effect for Expression {
    const INFO: EffectInfo = EffectInfo {
        id: "expression",
        title: "Term given as an expression",
        equation: "`expression` added to `target`",
        law: |_, _| "`expression` added to `target`".to_owned(),
        scope: Scope::Whole,
        site: Site::Target,
        depends_on: &[],
        parameters: &[],
        texts: &[
            TextInfo { name: "target", description: TARGETS },
            TextInfo { name: "expression", description: GRAMMAR },
        ],
        shows_in: "the residual of its target",
        source: "S. L. Brunton, J. L. Proctor, J. N. Kutz, Discovering governing equations from data, PNAS 113 (2016)",
        validity: "the range of the data it was found on",
        look_alikes: &[],
    };

    const REPEATS: bool = true;
    /// It may name time and any length.
    const IN_TIME: bool = true;
    const COUPLES_CABLES: bool = true;

    fn new(spec: &EffectSpec) -> Result<Self, SpecError> {
        let error = |message: String| SpecError::new("expression", message);
        let target = spec.target.as_deref().ok_or_else(|| error(format!("no `target`, expected {TARGETS}")))?;
        let target =
            read_target(target).ok_or_else(|| error(format!("`target` is {target:?}, expected {TARGETS}")))?;
        let text = spec.expression.as_deref().ok_or_else(|| error(format!("no `expression`, expected {GRAMMAR}")))?;
        let formula = Formula::parse(text).map_err(|e| error(format!("`expression` is {text:?}: {e}")))?;
        Ok(Self { target, formula })
    }

    /// The command of a servo is no force.
    fn check_command(&self, command: WinchCommand) -> Result<(), String> {
        if command.is_servo() && self.formula.uses(|v| matches!(v, Variable::WinchForce(_))) {
            return Err("`winch_force` is no input of winches that are commanded by speed or length".to_owned());
        }
        Ok(())
    }

    fn stage(&self) -> Stage {
        match self.target {
            Target::Platform(_) => Stage::PlatformWrench,
            Target::Winch(i) => Stage::WinchPull(i),
        }
    }

    fn pull<S: Real>(&self, context: &PlatformContext<'_, S>, _cable: usize) -> S {
        self.value(context)
    }

    fn wrench<S: Real>(&self, context: &PlatformContext<'_, S>) -> [S; 3] {
        let mut wrench = [S::from(0.0); 3];
        if let Target::Platform(axis) = self.target {
            wrench[axis] = self.value(context);
        }
        wrench
    }
}
