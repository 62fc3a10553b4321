!> The failures of the test that is running: assertions add to them, the runner reads them.
!!
!! Assertions stand alone in a test, without an argument that could carry what they found. So this
!! module, unlike any of the program itself, holds state.
module funit_failures
  implicit none
  private

  public :: SourceLocation, throw, anyExceptions, clear_failures, failure_t, failures

  !> The line of a test file that an assertion stands on.
  type :: SourceLocation
    character(:), allocatable :: file_name   !! without folders
    integer :: line = 0
  end type SourceLocation

  !> An assertion that did not hold.
  type :: failure_t
    type(SourceLocation) :: location   !! without a file name where the assertion had no location
    character(:), allocatable :: message
  end type failure_t

  type(failure_t), allocatable :: failures(:)   !! of the running test, unallocated if none

contains

  !> Note that an assertion did not hold: the words of the user, then those of the assertion.
  subroutine throw(found, message, location)
    character(*), intent(in) :: found
    character(*), intent(in), optional :: message
    type(SourceLocation), intent(in), optional :: location
    type(failure_t) :: failure

    failure%message = found
    if (present(message)) failure%message = trim(message)//": "//found
    if (present(location)) failure%location = location
    if (.not. allocated(failures)) allocate (failures(0))
    failures = [failures, failure]
  end subroutine throw

  !> Whether the running test has failed.
  logical function anyExceptions()
    anyExceptions = allocated(failures)
  end function anyExceptions

  !> Forget the failures of the test before.
  subroutine clear_failures()
    if (allocated(failures)) deallocate (failures)
  end subroutine clear_failures

end module funit_failures
