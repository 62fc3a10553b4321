!> A law whose rows take a given time where they flow: processor time, or sleep.
module slow_law
  use, intrinsic :: iso_c_binding, only: c_int
  use omp_lib, only: omp_get_num_threads
  use kinds, only: wp
  use elastic, only: elastic_t
  implicit none
  private

  !> Elastic; a row flows where a shear or normal stress of it passes the limit.
  type, extends(elastic_t), public :: slow_law_t
    real(wp) :: limit = huge(1.0_wp)   !! [stress]
    real(wp) :: work = 0.0_wp          !! processor time of a row that flows [s]
    integer :: sleep = 0               !! sleep of any row [1e-6 s]
    logical :: is_alone = .false.      !! fails where another thread works
  contains
    procedure :: update
  end type slow_law_t

  interface
    integer(c_int) function usleep(microseconds) bind(c)
      import :: c_int
      integer(c_int), value :: microseconds
    end function usleep
  end interface

contains

  subroutine update(self, n, dt, dstrain, stress, state, ok, spin)
    class(slow_law_t), intent(in) :: self
    integer, intent(in) :: n
    real(wp), intent(in) :: dt, dstrain(n, 6)
    real(wp), intent(inout) :: stress(n, 6), state(n, self%n_state)
    logical, intent(out) :: ok
    real(wp), intent(in), optional :: spin(n, 3)
    real(wp) :: start, now
    integer(c_int) :: rest

    call self%elastic_t%update(n, dt, dstrain, stress, state, ok, spin)
    if (self%is_alone) ok = ok .and. omp_get_num_threads() == 1
    rest = 0
    if (self%sleep > 0) rest = usleep(int(self%sleep, c_int))
    ok = ok .and. rest == 0
    if (.not. maxval(abs(stress)) > self%limit) return
    call cpu_time(start)
    now = start
    do while (now < start + self%work*n/24)
      call cpu_time(now)
    end do
  end subroutine update

end module slow_law
