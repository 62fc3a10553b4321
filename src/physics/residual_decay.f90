!> How far a relaxation is, from the decay of its residuals. For the log only: nothing of a run
!! depends on it, and no checkpoint holds it.
module residual_decay
  use kinds, only: wp
  implicit none
  private

  public :: decay_t, note_residuals, increments_left

  integer, parameter :: most_marks = 64, least_marks = most_marks/2

  !> Residuals over their limits since the loads are constant. Each mark holds the logarithm of the
  !! largest ones of so many increments; when all marks are in use, two become one.
  type :: decay_t
    private
    integer :: n_marks = 0
    integer :: spacing = 1                         ! increments of a mark
    integer :: n_open = 0                          ! increments of the mark that is not full yet
    real(wp) :: open(2) = 0.0_wp
    real(wp) :: marks(2, most_marks) = 0.0_wp
    real(wp) :: top(2) = 0.0_wp                    ! largest since the loads are constant
    real(wp) :: left = -1.0_wp                     ! increments from the last mark on; < 0: unknown
    real(wp), public :: fraction = -1.0_wp         !! done; < 0: the decay is not measurable yet
  end type decay_t

contains

  !> Take the residuals of an increment.
  pure subroutine note_residuals(decay, residuals, limits)
    type(decay_t), intent(inout) :: decay
    real(wp), intent(in) :: residuals(2), limits(2)   !! relative, of energy and force
    real(wp) :: ratios(2)
    integer :: i

    ! Before anything has deformed there is nothing to compare with, and they have no bound.
    ratios = min(residuals, 1.0_wp)/max(limits, tiny(1.0_wp))
    decay%top = max(decay%top, ratios)
    decay%open = max(decay%open, ratios)
    decay%n_open = decay%n_open + 1
    if (decay%n_open < decay%spacing) return
    decay%n_marks = decay%n_marks + 1
    decay%marks(:, decay%n_marks) = log(max(decay%open, tiny(1.0_wp)))
    decay%open = 0.0_wp
    decay%n_open = 0
    if (decay%n_marks >= least_marks) call judge(decay)
    if (decay%n_marks < most_marks) return
    do i = 1, most_marks/2
      decay%marks(:, i) = max(decay%marks(:, 2*i - 1), decay%marks(:, 2*i))
    end do
    decay%n_marks = most_marks/2
    decay%spacing = 2*decay%spacing
  end subroutine note_residuals

  !> Increments until both residuals are within their limits; negative where that is unknown: before
  !! the decay is measurable, and while a slow motion sets in and a residual grows.
  pure real(wp) function increments_left(decay) result(left)
    type(decay_t), intent(in) :: decay

    left = decay%left
    if (decay%fraction >= 1.0_wp) left = 0.0_wp
    if (left >= 0.0_wp) left = max(0.0_wp, left - decay%n_open)
  end function increments_left

  !> Fit exponentials to the later half of the marks. The fraction is the smaller one of the part of
  !! the decay that is done, in the logarithm, and of the part of the increments: fast motions come
  !! to rest first and say little about slow ones. It does not fall while the residuals decay; where
  !! a slow motion sets in and one of them grows, it is unknown again.
  pure subroutine judge(decay)
    type(decay_t), intent(inout) :: decay
    real(wp), parameter :: least_decay = 0.7_wp    ! of the logarithm since the largest residual
    real(wp), parameter :: growth = 0.3_wp         ! of the logarithm over the later half
    real(wp), parameter :: longest = 10.0_wp       ! that is foretold, in increments so far
    real(wp), parameter :: almost = 0.99_wp        ! only rest itself is the end
    real(wp) :: fraction, left, level, slope, done
    integer :: i

    done = real(decay%n_marks, wp)*decay%spacing
    fraction = almost
    left = 0.0_wp
    decay%left = -1.0_wp
    do i = 1, 2
      call fit(decay%marks(i, decay%n_marks/2 + 1:decay%n_marks), level, slope)
      level = max(level, decay%marks(i, decay%n_marks))
      if (level <= 0.0_wp) cycle
      if (slope*(decay%n_marks/2) > growth) decay%fraction = -1.0_wp
      associate (top => log(decay%top(i)))
        if (.not. (slope < 0.0_wp .and. top - level > least_decay)) return
        fraction = min(fraction, 1.0_wp - level/top)
        left = max(left, -level/slope*decay%spacing)
      end associate
    end do
    if (.not. left < longest*done) return
    decay%left = left
    decay%fraction = max(decay%fraction, min(fraction, done/(done + left)))
  end subroutine judge

  !> Straight line through values at equal distances, by least squares.
  pure subroutine fit(values, last, slope)
    real(wp), intent(in) :: values(:)
    real(wp), intent(out) :: last       !! value of the line at the last one
    real(wp), intent(out) :: slope      !! from one value to the next
    real(wp) :: middle, x(size(values))
    integer :: i

    middle = 0.5_wp*(size(values) + 1)
    x = [(i - middle, i=1, size(values))]
    slope = sum(x*values)/sum(x**2)
    last = sum(values)/size(values) + slope*(size(values) - middle)
  end subroutine fit

end module residual_decay
