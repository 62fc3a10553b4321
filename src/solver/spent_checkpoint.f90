!> What becomes of the checkpoint of a run that is complete.
module spent_checkpoint
  use kinds, only: wp
  use failure, only: error_t
  use system_files, only: remove_file, sync_file
  use state_store, only: state_store_t, enter_folder, carry
  use checkpoint, only: read_checkpoint
  use run_log, only: run_log_t, log_line
  use run_data, only: run_t
  use run_saver, only: saver_t
  implicit none
  private

  public :: drop_checkpoint

contains

  !> The run is complete: a checkpoint that was to save it alone goes, once the result is on the
  !! disk, and so does one that an earlier run of this deck has left half way.
  subroutine drop_checkpoint(saver, run, log)
    type(saver_t), intent(inout) :: saver
    type(run_t), intent(in) :: run
    type(run_log_t), intent(inout) :: log
    character(:), allocatable :: reason

    if (saver%is_lasting) return
    if (saver%saved_step < 0) then
      if (.not. is_overtaken(saver, run)) return
    end if
    if (.not. sync_file(saver%result_file, reason)) then
      call log_line(log, "warning: checkpoint "//saver%path//" stays: the result cannot be "// &
                    "brought to the disk: "//reason)
      return
    end if
    call remove_file(saver%path, reason)
    if (reason == "") then
      call log_line(log, "checkpoint "//saver%path//" removed, since the run is complete")
    else
      call log_line(log, "warning: checkpoint "//saver%path//" cannot be removed: "//reason)
    end if
  end subroutine drop_checkpoint

  !> Is there a checkpoint of this deck in which it had come no further?
  logical function is_overtaken(saver, run)
    type(saver_t), intent(in) :: saver
    type(run_t), intent(in) :: run
    type(state_store_t) :: store
    type(error_t), allocatable :: error
    real(wp) :: time

    inquire (file=saver%path, exist=is_overtaken)
    if (is_overtaken) call read_checkpoint(saver%path, saver%header, store, error)
    is_overtaken = is_overtaken .and. .not. allocated(error)
    if (.not. is_overtaken) return
    store%is_taking = .true.
    time = huge(1.0_wp)
    call enter_folder(store, "run")
    call carry(store, "time", time)
    is_overtaken = time <= run%instant%time
  end function is_overtaken

end module spent_checkpoint
