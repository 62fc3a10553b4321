!> Frames that are filled and wait for the state behind them to prove good.
module waiting_frames
  use failure, only: error_t
  use timer, only: start_watch, stop_watch
  use model, only: model_t
  use frames, only: results_t, frame_t, write_frame
  use frame_content, only: fill_frame
  use run_data, only: run_t
  implicit none
  private

  public :: n_waiting_frames, add_frame, release_frames, keep_first_frames

contains

  !> How many wait.
  pure integer function n_waiting_frames(run) result(n)
    type(run_t), intent(in) :: run

    n = run%n_earlier + merge(1, 0, run%has_frame)
  end function n_waiting_frames

  !> Fill one more. Of frames close to each other those before wait beside it.
  subroutine add_frame(model, run)
    type(model_t), intent(inout) :: model
    type(run_t), intent(inout) :: run
    type(frame_t), allocatable :: wider(:)
    integer :: i

    if (run%has_frame) then
      if (.not. allocated(run%earlier)) allocate (run%earlier(1))
      if (run%n_earlier == size(run%earlier)) then
        allocate (wider(2*run%n_earlier))
        do i = 1, run%n_earlier
          wider(i) = run%earlier(i)
        end do
        call move_alloc(wider, run%earlier)
      end if
      run%n_earlier = run%n_earlier + 1
      run%earlier(run%n_earlier) = run%frame
    end if
    call fill_frame(model, run%instant%time, run%frame)
    run%has_frame = .true.
  end subroutine add_frame

  !> Write the first of the frames, and the history, or its first rows.
  subroutine release_frames(model, run, results, n, error, n_rows)
    type(model_t), intent(inout) :: model         !! its timer alone
    type(run_t), intent(inout) :: run
    type(results_t), intent(inout) :: results
    integer, intent(in) :: n                      !! how many; none: nothing is written
    type(error_t), allocatable, intent(out) :: error
    integer, intent(in), optional :: n_rows       !! absent: all that wait
    integer :: i, n_before

    if (n == 0) return
    call start_watch(model%timer, run%watch_output)
    n_before = min(n, run%n_earlier)
    do i = 1, n_before
      if (.not. allocated(error)) call write_one(run%earlier(i), i == 1)
    end do
    if (n > n_before .and. .not. allocated(error)) call write_one(run%frame, n_before == 0)
    do i = 1, run%n_earlier - n_before
      run%earlier(i) = run%earlier(i + n_before)
    end do
    run%n_earlier = run%n_earlier - n_before
    if (n > n_before) run%has_frame = .false.
    run%is_file_lost = allocated(error)
    call stop_watch(model%timer, run%watch_output)

  contains

    subroutine write_one(frame, is_first)
      type(frame_t), intent(in) :: frame
      logical, intent(in) :: is_first

      if (.not. present(n_rows)) then
        call write_frame(results, frame, error)
      else
        call write_frame(results, frame, error, merge(n_rows, 0, is_first))
      end if
    end subroutine write_one
  end subroutine release_frames

  !> Let go of all but the first.
  subroutine keep_first_frames(run, n)
    type(run_t), intent(inout) :: run
    integer, intent(in) :: n

    if (n >= n_waiting_frames(run)) return
    run%n_earlier = n
    run%has_frame = .false.
  end subroutine keep_first_frames

end module waiting_frames
