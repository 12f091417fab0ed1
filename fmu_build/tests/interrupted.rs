//! What an interruption removes. In a process of its own: it removes what every thread has begun.

use cdpr_fmu_build::temporary::TemporaryFolder;
use cdpr_fmu_build::unfinished::remove_all_and;
use cdpr_fmu_build::whole_file;

#[test]
fn what_is_unfinished_is_removed_and_what_is_done_stays() {
    let folder = tempfile::tempdir().unwrap();
    let done = folder.path().join("done");
    whole_file::write(&done, b"x").unwrap();
    let begun = folder.path().join("begun");
    let _unfinished = whole_file::WholeFile::create(&begun).unwrap();
    let temporary = TemporaryFolder::new().unwrap();
    std::fs::write(temporary.path().join("inside"), "x").unwrap();
    let files = || std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(files(), 2);
    let ended = remove_all_and(|| true);
    assert!(ended && done.exists() && !temporary.path().exists());
    assert_eq!(files(), 1, "the file that was begun is gone");
}
