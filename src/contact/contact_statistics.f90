!> What the searches of a contact cost, for the log and for checks.
module contact_statistics
  use, intrinsic :: iso_fortran_env, only: int64
  implicit none
  private

  public :: contact_statistics_t, count_iterations, count_failure, add_counts

  !> Counts over all calls; `n_touching` of the last call.
  type :: contact_statistics_t
    integer(int64) :: n_calls = 0
    integer(int64) :: n_points = 0       !! points times calls
    integer(int64) :: n_tested = 0       !! of these, closest points computed; the rest was culled
    integer(int64) :: n_iterations = 0   !! face evaluations of the local searches
    integer(int64) :: n_fallbacks = 0    !! points that left the eight lanes for the guarded search
    integer(int64) :: n_searches = 0     !! global searches
    integer(int64) :: n_failures = 0     !! points for which every search failed: must be 0
    integer :: max_iterations = 0        !! in one search of one point
    integer :: n_touching = 0
    integer :: first_failed = 0          !! point that was the first to fail, 0: none
  end type contact_statistics_t

contains

  !> Count face evaluations of local searches.
  pure subroutine count_iterations(counts, n_iterations, n_points)
    type(contact_statistics_t), intent(inout) :: counts
    integer, intent(in) :: n_iterations, n_points

    counts%n_iterations = counts%n_iterations + n_iterations*n_points
    counts%max_iterations = max(counts%max_iterations, n_iterations)
  end subroutine count_iterations

  !> Count a point for which every search failed.
  pure subroutine count_failure(counts, point)
    type(contact_statistics_t), intent(inout) :: counts
    integer, intent(in) :: point

    counts%n_failures = counts%n_failures + 1
    if (counts%first_failed == 0) counts%first_failed = point
  end subroutine count_failure

  !> Add the counts of a tile to those of the contact.
  pure subroutine add_counts(total, part)
    type(contact_statistics_t), intent(inout) :: total
    type(contact_statistics_t), intent(in) :: part

    total%n_tested = total%n_tested + part%n_tested
    total%n_iterations = total%n_iterations + part%n_iterations
    total%n_fallbacks = total%n_fallbacks + part%n_fallbacks
    total%n_searches = total%n_searches + part%n_searches
    total%n_failures = total%n_failures + part%n_failures
    if (total%first_failed == 0) total%first_failed = part%first_failed
    total%max_iterations = max(total%max_iterations, part%max_iterations)
    total%n_touching = total%n_touching + part%n_touching
  end subroutine add_counts

end module contact_statistics
