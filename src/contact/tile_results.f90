!> What a tile of contact points found, and how processes that each work some of the tiles exchange
!! it.
module tile_results
  use, intrinsic :: iso_fortran_env, only: int64
  use kinds, only: wp
  use ranks, only: ranks_t, traffic_t, gather_counted
  use state_store, only: state_store_t, carry
  use contact_tiles, only: tile_t
  implicit none
  private

  public :: contact_statistics_t, tile_result_t, count_iterations
  public :: add_result, add_counts, exchange_results, exchange_forces, find_points_of
  public :: numbers_of, result_of, carry_counts

  !> Counts over all calls; `n_touching` of the last call.
  type :: contact_statistics_t
    integer(int64) :: n_calls = 0
    integer(int64) :: n_points = 0       !! points times calls
    integer(int64) :: n_tested = 0       !! of these, closest points computed; the rest was culled
    integer(int64) :: n_iterations = 0   !! face evaluations of the local searches
    integer(int64) :: n_fallbacks = 0    !! points that left the eight lanes for a single search
    integer(int64) :: n_searches = 0     !! global searches
    integer(int64) :: n_failures = 0     !! points for which every search failed: must be 0
    integer :: max_iterations = 0        !! in one search of one point
    integer :: n_touching = 0
    integer :: first_failed = 0          !! point that was the first to fail, 0: none
  end type contact_statistics_t

  !> How far points move in a step at most, and what one tile adds to the whole.
  type :: tile_result_t
    real(wp) :: longest = 0.0_wp   !! along a normal, amply [length]
    real(wp) :: energy = 0.0_wp, depth = 0.0_wp, reaction(3) = 0.0_wp
    real(wp) :: slip_work = 0.0_wp, damped = 0.0_wp, passed = 0.0_wp   !! energies lost
    type(contact_statistics_t) :: counts
  end type tile_result_t

  integer, parameter, public :: n_result_numbers = 16
  integer, parameter :: n_numbers = n_result_numbers + 1   ! with the travel of the next test

contains

  !> Count face evaluations of local searches.
  pure subroutine count_iterations(counts, n_iterations, n_points)
    type(contact_statistics_t), intent(inout) :: counts
    integer, intent(in) :: n_iterations, n_points

    counts%n_iterations = counts%n_iterations + n_iterations*n_points
    counts%max_iterations = max(counts%max_iterations, n_iterations)
  end subroutine count_iterations

  !> Put counts, or take them back.
  pure subroutine carry_counts(counts, store)
    type(contact_statistics_t), intent(inout) :: counts
    type(state_store_t), intent(inout) :: store

    call carry(store, "n_calls", counts%n_calls)
    call carry(store, "n_points", counts%n_points)
    call carry(store, "n_tested", counts%n_tested)
    call carry(store, "n_iterations", counts%n_iterations)
    call carry(store, "n_fallbacks", counts%n_fallbacks)
    call carry(store, "n_searches", counts%n_searches)
    call carry(store, "n_failures", counts%n_failures)
    call carry(store, "max_iterations", counts%max_iterations)
    call carry(store, "first_failed", counts%first_failed)
  end subroutine carry_counts

  !> Add what a tile, or a band of them, has found.
  pure subroutine add_result(part, total)
    type(tile_result_t), intent(in) :: part
    type(tile_result_t), intent(inout) :: total

    total%energy = total%energy + part%energy
    total%depth = max(total%depth, part%depth)
    total%reaction = total%reaction + part%reaction
    total%slip_work = total%slip_work + part%slip_work
    total%damped = total%damped + part%damped
    total%passed = total%passed + part%passed
    total%counts%n_touching = total%counts%n_touching + part%counts%n_touching
    call add_counts(part%counts, total%counts)
  end subroutine add_result

  !> Add the counts of searches.
  pure subroutine add_counts(part, total)
    type(contact_statistics_t), intent(in) :: part
    type(contact_statistics_t), intent(inout) :: total

    total%n_tested = total%n_tested + part%n_tested
    total%n_iterations = total%n_iterations + part%n_iterations
    total%n_fallbacks = total%n_fallbacks + part%n_fallbacks
    total%n_searches = total%n_searches + part%n_searches
    total%n_failures = total%n_failures + part%n_failures
    if (total%first_failed == 0) total%first_failed = part%first_failed
    total%max_iterations = max(total%max_iterations, part%max_iterations)
  end subroutine add_counts

  !> How many numbers come from each process, and where those of each tile begin among all, less
  !! one.
  pure subroutine find_places(ranks, owners, sizes, counts, places)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: owners(:)           !! of the tiles
    integer, intent(in) :: sizes(:)            !! numbers of each of them
    integer, intent(out) :: counts(:), places(:)
    integer :: at(ranks%n), i

    counts = 0
    do i = 1, size(owners)
      associate (n => counts(owners(i) + 1))
        n = n + sizes(i)
      end associate
    end do
    at(1) = 0
    do i = 2, ranks%n
      at(i) = at(i - 1) + counts(i - 1)
    end do
    do i = 1, size(owners)
      associate (next => at(owners(i) + 1))
        places(i) = next
        next = next + sizes(i)
      end associate
    end do
  end subroutine find_places

  !> Results of tiles, and when they must be tested again, at all processes.
  subroutine exchange_results(ranks, owners, test_at, results, traffic)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: owners(:)                     !! processes that have them
    real(wp), intent(inout) :: test_at(:)                !! travel
    type(tile_result_t), intent(inout) :: results(:)
    type(traffic_t), intent(inout) :: traffic
    integer :: places(size(owners)), counts(ranks%n), i, n
    real(wp) :: own(n_numbers*size(owners)), joined(n_numbers*size(owners))

    call find_places(ranks, owners, spread(n_numbers, 1, size(owners)), counts, places)
    n = 0
    do i = 1, size(owners)
      if (owners(i) /= ranks%number) cycle
      own(n + 1:n + n_numbers) = [test_at(i), numbers_of(results(i))]
      n = n + n_numbers
    end do
    call gather_counted(ranks, counts, own, joined, traffic)
    do i = 1, size(owners)
      if (owners(i) == ranks%number) cycle
      test_at(i) = joined(places(i) + 1)
      results(i) = result_of(joined(places(i) + 2:places(i) + n_numbers))
    end do
  end subroutine exchange_results

  !> A result as numbers.
  pure function numbers_of(result) result(numbers)
    type(tile_result_t), intent(in) :: result
    real(wp) :: numbers(n_result_numbers)

    associate (counts => result%counts)
      numbers = [result%energy, result%depth, result%reaction, result%slip_work, result%damped, &
                 result%passed, real(counts%n_tested, wp), real(counts%n_iterations, wp), &
                 real(counts%n_fallbacks, wp), real(counts%n_searches, wp), &
                 real(counts%n_failures, wp), real(counts%max_iterations, wp), &
                 real(counts%n_touching, wp), real(counts%first_failed, wp)]
    end associate
  end function numbers_of

  !> And back.
  pure function result_of(numbers) result(found)
    real(wp), intent(in) :: numbers(n_result_numbers)
    type(tile_result_t) :: found

    found%energy = numbers(1)
    found%depth = numbers(2)
    found%reaction = numbers(3:5)
    found%slip_work = numbers(6)
    found%damped = numbers(7)
    found%passed = numbers(8)
    found%counts%n_tested = nint(numbers(9), int64)
    found%counts%n_iterations = nint(numbers(10), int64)
    found%counts%n_fallbacks = nint(numbers(11), int64)
    found%counts%n_searches = nint(numbers(12), int64)
    found%counts%n_failures = nint(numbers(13), int64)
    found%counts%max_iterations = nint(numbers(14))
    found%counts%n_touching = nint(numbers(15))
    found%counts%first_failed = nint(numbers(16))
  end function result_of

  !> Forces of tiles on their control points, at all processes.
  subroutine exchange_forces(ranks, touching, owners, forces, traffic)
    class(ranks_t), intent(in) :: ranks
    integer, intent(in) :: touching(:)                   !! tiles
    integer, intent(in) :: owners(:)                     !! of all tiles
    real(wp), intent(inout) :: forces(:, :, :, :)        !! of all tiles, the last index
    type(traffic_t), intent(inout) :: traffic
    integer :: places(size(touching)), counts(ranks%n), i, n, m
    real(wp), allocatable :: own(:), joined(:)

    m = size(forces)/max(1, size(forces, 4))
    call find_places(ranks, owners(touching), spread(m, 1, size(touching)), counts, places)
    allocate (own(m*size(touching)), joined(m*size(touching)))
    n = 0
    do i = 1, size(touching)
      if (owners(touching(i)) /= ranks%number) cycle
      own(n + 1:n + m) = reshape(forces(:, :, :, touching(i)), [m])
      n = n + m
    end do
    call gather_counted(ranks, counts, own, joined, traffic)
    do i = 1, size(touching)
      if (owners(touching(i)) == ranks%number) cycle
      forces(:, :, :, touching(i)) = reshape(joined(places(i) + 1:places(i) + m), &
                                             shape(forces(:, :, :, 1)))
    end do
  end subroutine exchange_forces

  !> Points of the tiles that a process works, in rising order.
  pure subroutine find_points_of(process, tiles, owners, n_along, points)
    integer, intent(in) :: process                       !! its number
    type(tile_t), intent(in) :: tiles(:)
    integer, intent(in) :: owners(:)                     !! of the tiles
    integer, intent(in) :: n_along(2)                    !! points of the face by direction
    integer, allocatable, intent(out) :: points(:)
    logical :: is_here(n_along(1), n_along(2))
    integer :: t, i

    do t = 1, size(tiles)
      associate (low => tiles(t)%first, high => tiles(t)%last)
        is_here(low(1):high(1), low(2):high(2)) = owners(t) == process
      end associate
    end do
    points = pack([(i, i=1, size(is_here))], reshape(is_here, [size(is_here)]))
  end subroutine find_points_of

end module tile_results
