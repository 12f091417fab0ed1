//! From C arguments to slices and values, checked as far as C allows.

use std::ffi::CStr;
use std::mem::MaybeUninit;
use std::slice;

use super::{Boolean, Enumeration, String as FmiString};
use crate::failure::{Failure, Outcome};
use crate::instance::StatusKind;

/// Refuse a null or misaligned array, and a count beyond all reason.
fn check_array<T>(what: &str, pointer: *const T, count: usize, limit: usize) -> Outcome {
    if count > limit {
        return Err(Failure::refused(format!("{what}: {count} entries, but at most {limit} make sense")));
    }
    if count > isize::MAX as usize / size_of::<T>().max(1) {
        return Err(Failure::refused(format!("{what}: {count} entries do not fit into memory")));
    }
    check_pointer(what, pointer)
}

fn check_pointer<T>(what: &str, pointer: *const T) -> Outcome {
    if pointer.is_null() {
        return Err(Failure::refused(format!("{what} is null")));
    }
    if !pointer.is_aligned() {
        return Err(Failure::refused(format!("{what} is not aligned")));
    }
    Ok(())
}

/// The `count` values that the host passes at `pointer`.
///
/// # Safety
/// If the checks here pass, `pointer` leads to `count` values that nobody changes during `'a`.
pub(super) unsafe fn input<'a, T>(what: &str, pointer: *const T, count: usize, limit: usize) -> Outcome<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    check_array(what, pointer, count, limit)?;
    // SAFETY: not null, aligned, of a possible size; the rest is the caller's promise.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// Room for `count` values that the host wants at `pointer`.
///
/// # Safety
/// If the checks here pass, `pointer` leads to room for `count` values that nobody else uses during
/// `'a`.
pub(super) unsafe fn output<'a, T>(
    what: &str,
    pointer: *mut T,
    count: usize,
    limit: usize,
) -> Outcome<&'a mut [MaybeUninit<T>]> {
    if count == 0 {
        return Ok(&mut []);
    }
    check_array(what, pointer, count, limit)?;
    // SAFETY: not null, aligned, of a possible size; the rest is the caller's promise. What is there
    // before may be anything, hence `MaybeUninit`.
    Ok(unsafe { slice::from_raw_parts_mut(pointer.cast(), count) })
}

/// Room for one value.
///
/// # Safety
/// As for [`output`].
pub(super) unsafe fn place<'a, T>(what: &str, pointer: *mut T) -> Outcome<&'a mut MaybeUninit<T>> {
    check_pointer(what, pointer)?;
    // SAFETY: not null and aligned; the rest is the caller's promise.
    Ok(unsafe { &mut *pointer.cast() })
}

/// One value that is there already and may be changed.
///
/// # Safety
/// If the checks here pass, `pointer` leads to an initialised value that nobody else uses during `'a`.
pub(super) unsafe fn value<'a, T>(what: &str, pointer: *mut T) -> Outcome<&'a mut T> {
    check_pointer(what, pointer)?;
    // SAFETY: not null and aligned; the rest is the caller's promise.
    Ok(unsafe { &mut *pointer })
}

/// A C string.
///
/// # Safety
/// If not null, `pointer` leads to a NUL-terminated string that nobody changes during `'a`.
pub(super) unsafe fn c_str<'a>(what: &str, pointer: FmiString) -> Outcome<&'a CStr> {
    if pointer.is_null() {
        return Err(Failure::refused(format!("{what} is null")));
    }
    // SAFETY: not null; the rest is the caller's promise.
    Ok(unsafe { CStr::from_ptr(pointer) })
}

/// A C string in UTF-8.
///
/// # Safety
/// As for [`c_str`].
pub(super) unsafe fn text<'a>(what: &str, pointer: FmiString) -> Outcome<&'a str> {
    // SAFETY: the caller's promise.
    let c_str = unsafe { c_str(what, pointer) }?;
    c_str.to_str().map_err(|_| Failure::refused(format!("{what} is not UTF-8")))
}

/// `fmi2True` or `fmi2False`, and nothing else.
pub(super) fn boolean(value: Boolean) -> Outcome<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Failure::refused(format!("{other} is neither fmi2True nor fmi2False"))),
    }
}

/// `fmi2StatusKind`.
pub(super) fn status_kind(value: Enumeration) -> Outcome<StatusKind> {
    match value {
        0 => Ok(StatusKind::DoStep),
        1 => Ok(StatusKind::Pending),
        2 => Ok(StatusKind::LastSuccessfulTime),
        3 => Ok(StatusKind::Terminated),
        other => Err(Failure::refused(format!("{other} is no fmi2StatusKind"))),
    }
}
